// Gauss-Legendre points on a part of a ray, as a collocation method: order 2 ORDER for what is hidden and for its colour
// (docs/decisions/0007-rays.md; the numbers come from gauss_rule in nodegraph/data/preintegration.py).

#ifndef ORDER
#define ORDER 3         // points
#endif

uniform float nodes[ORDER];             // in 0..1
uniform float weights[ORDER];
uniform float before[ORDER * ORDER];    // row i: what the length before node i weighs at each node

struct Seen {
    float depth;            // optical depth
    float shares[ORDER];    // of the colours of the points in what is seen of the part; their sum is 1, or 0 if it is nothing
};

// A part of `length` mm, by the extinctions at its points.
Seen see(float extinction[ORDER], float length) {
    Seen seen;
    seen.depth = 0.0;
    // Only the ratios count: from the least that lies before a point which can be seen, so that in the thickest part there
    // is one share which is not nothing, and none beyond all bounds.
    float ahead[ORDER];
    float least = 3.0e38;
    for (int i = 0; i < ORDER; ++i) {
        seen.depth += weights[i] * extinction[i] * length;
        ahead[i] = 0.0;
        for (int j = 0; j < ORDER; ++j) {
            ahead[i] += before[i * ORDER + j] * extinction[j];
        }
        least = extinction[i] > 0.0 ? min(least, ahead[i]) : least;
    }
    float total = 0.0;
    for (int i = 0; i < ORDER; ++i) {
        seen.shares[i] = extinction[i] > 0.0 ? weights[i] * extinction[i] * exp((least - ahead[i]) * length) : 0.0;
        total += seen.shares[i];
    }
    for (int i = 0; i < ORDER; ++i) {
        seen.shares[i] = total > 0.0 ? seen.shares[i] / total : 0.0;
    }
    return seen;
}
