// Guess the pixels between those of a coarser grid, in three phases. Pixel (i, j) of the coarser grid is pixel
// (2 i, 2 j) of this one. Source: Orhun 2004, OR-60.

#ifndef PHASE
#define PHASE 0         // 0: whether a cell of the coarser grid is even, 1: guess, 2: put guessed and cast together
#endif

field2 color;           // PHASE 0 and 1: of the coarser grid; 2: what was guessed
field2 depth;
field2 known;           // PHASE 1: where cells are even; 2: where the guess holds
field2 cast_color;
field2 cast_depth;
uniform float tolerance;

struct Result {
    vec4 color;
    float depth;
    float known;        // 0 or 1
};

#if PHASE == 0
// A cell is even where its corners and those of the cells around it agree. Without these an edge that bends into a
// cell between two of its corners would be cut off.
float pixel(ivec2 at) {
    ivec2 last = size2(color) - 1;
    vec4 low = fetch2(color, at);
    vec4 high = low;
    float near = fetch2(depth, at).x;
    float far = near;
    bool numbers = true;
    for (int j = -1; j <= 2; ++j) {
        for (int i = -1; i <= 2; ++i) {
            ivec2 corner = clamp(at + ivec2(i, j), ivec2(0), last);
            vec4 c = fetch2(color, corner);
            float d = fetch2(depth, corner).x;
            numbers = numbers && !any(isnan(c));
            low = min(low, c);
            high = max(high, c);
            near = min(near, d);
            far = max(far, d);
        }
    }
    bool same = isinf(near) || (!isinf(far) && far - near <= tolerance * near);
    return numbers && same && all(lessThanEqual(high - low, vec4(tolerance))) ? 1.0 : 0.0;
}
#endif

#if PHASE == 1
Result pixel(ivec2 at) {
    ivec2 low = at / 2;
    ivec2 odd = at - 2 * low;
    ivec2 high = low + odd;
    // Beyond the last corner of the coarser grid there is nothing to go by.
    bool even = fetch2(known, low).x > 0.0 && !any(greaterThan(high, size2(color) - 1));
    if (odd.x + odd.y > 0 && !even) {
        return Result(vec4(0.0), 0.0, 0.0);
    }
    vec2 t = 0.5 * vec2(odd);
    ivec2 right = ivec2(high.x, low.y);
    ivec2 below = ivec2(low.x, high.y);
    vec4 top = mix(fetch2(color, low), fetch2(color, right), t.x);
    vec4 bottom = mix(fetch2(color, below), fetch2(color, high), t.x);
    float first = fetch2(depth, low).x;
    float result = first;
    if (!isinf(first)) {
        float upper = mix(first, fetch2(depth, right).x, t.x);
        result = mix(upper, mix(fetch2(depth, below).x, fetch2(depth, high).x, t.x), t.y);
    }
    return Result(mix(top, bottom, t.y), result, 1.0);
}
#endif

#if PHASE == 2
Result pixel(ivec2 at) {
    if (fetch2(known, at).x > 0.0) {
        return Result(fetch2(color, at), fetch2(depth, at).x, 1.0);
    }
    return Result(fetch2(cast_color, at), fetch2(cast_depth, at).x, 1.0);
}
#endif
