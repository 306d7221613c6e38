// Smooth pieces of a ray, laid under each other as they are found: what the ray-casters by cells share.
#include "common/emission.glsl"

const float NEVER = 3.0e38;
const float AGREED = 2.0e-7;        // of the colour of the ray, for each part of a piece
const float MOST_PARTS = 256.0;     // of a piece that is smooth

struct Sum {
    vec3 color;
    float hidden;
    float depth;    // mm from the ray's origin where depth_opacity is passed; NEVER before that
};

struct Piece {
    vec3 color;     // of what is seen of it, illuminated
    float depth;    // optical depth
};

Sum add(Sum sum, Piece piece) {
    float share = (1.0 - sum.hidden) * -expm1(-piece.depth);
    return Sum(sum.color + share * piece.color, sum.hidden + share, sum.depth);
}

// Share of a piece at whose end `depth_opacity` is hidden, as if the extinction went evenly from one of its ends to the
// other; `before` is what lies before it.
float reached(Sum before, float depth, float front, float back) {
    float target = log((1.0 - before.hidden) / (1.0 - depth_opacity)) / depth * 0.5 * (front + back);
    float root = front + sqrt(max(front * front + 2.0 * (back - front) * target, 0.0));
    return root > 0.0 ? clamp(2.0 * target / root, 0.0, 1.0) : 0.0;
}
