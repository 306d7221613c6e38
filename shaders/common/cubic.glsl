// Cubics along a part of a ray: what a trilinear field is inside of one cell.

// A cubic in s, -1/2 at the entry of a cell and 1/2 at its exit.
struct Cubic {
    vec4 c;
};

float value_of(Cubic f, float s) {
    return f.c.x + s * (f.c.y + s * (f.c.z + s * f.c.w));
}

// The cubic through the values at s = -3/8, -1/8, 1/8, 3/8.
Cubic cubic_through(vec4 v) {
    float even_far = 0.5 * (v.w + v.x);
    float even_near = 0.5 * (v.z + v.y);
    float odd_far = 0.5 * (v.w - v.x);
    float odd_near = 0.5 * (v.z - v.y);
    float c2 = (even_far - even_near) * 8.0;
    float c3 = (odd_far - 3.0 * odd_near) * (64.0 / 3.0);
    return Cubic(vec4(even_near - c2 / 64.0, 8.0 * odd_near - c3 / 64.0, c2, c3));
}

// Where the cubic turns inside the cell, in order; 1/2 for each place that is not there.
vec2 turns_of(Cubic f) {
    float a = 3.0 * f.c.w;
    float b = 2.0 * f.c.z;
    float c = f.c.y;
    float discriminant = b * b - 4.0 * a * c;
    vec2 found = vec2(0.5);
    if (discriminant > 0.0) {
        // Without cancellation: one root from the sum of equal signs, the other from the product of both.
        float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
        float one = a != 0.0 ? q / a : 0.5;
        float other = q != 0.0 ? c / q : 0.5;
        one = one > -0.5 && one < 0.5 ? one : 0.5;
        other = other > -0.5 && other < 0.5 ? other : 0.5;
        found = vec2(min(one, other), max(one, other));
    }
    return found;
}

// Where the cubic, which only rises or only falls from low to high, takes a value that it takes there.
float root_of(Cubic f, float value, float low, float high) {
    float a = low;
    float b = high;
    bool rising = value_of(f, high) > value_of(f, low);
    float s = 0.5 * (a + b);
    float error = 1.0;
    for (int i = 0; i < 40 && error != 0.0 && b > a; ++i) {
        error = value_of(f, s) - value;
        if (error > 0.0 == rising) {
            b = s;
        } else {
            a = s;
        }
        // Newton's step where it stays between, else the middle.
        float slope = f.c.y + s * (2.0 * f.c.z + s * 3.0 * f.c.w);
        float next = s - error / slope;
        next = next >= a && next <= b ? next : 0.5 * (a + b);
        if (next == s) {
            a = b;
        }
        s = next;
    }
    return s;
}

// The first place behind s where the cubic passes 0, or `stop`.
float next_zero(Cubic f, float s, float stop) {
    vec2 turns = turns_of(f);
    float low = s + 1.0e-6;
    float found = stop;
    for (int part = 0; part < 3; ++part) {
        float high = min(part == 0 ? turns.x : part == 1 ? turns.y : stop, stop);
        if (found == stop && low < high && value_of(f, low) * value_of(f, high) < 0.0) {
            found = root_of(f, 0.0, low, high);
        }
        low = max(low, high);
    }
    return found;
}
