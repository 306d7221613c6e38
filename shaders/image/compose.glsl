// Two pictures into one.

#ifndef MODE
#define MODE 0              // 0 over, 1 nearest, 2 add, 3 multiply, 4 mix
#endif

field2 front;
field2 back;
field2 front_depth;
field2 back_depth;
uniform float weight;       // share of the front in `mix`

struct Result {
    vec4 color;
    float depth;
};

// A depth that is no number is none: infinitely far.
float distance_of(float depth) {
    return isnan(depth) ? uintBitsToFloat(0x7f800000u) : depth;
}

Result pixel(ivec2 at) {
    vec4 a = fetch2(front, at);
    vec4 b = fetch2(back, at);
    float za = distance_of(fetch2(front_depth, at).x);
    float zb = distance_of(fetch2(back_depth, at).x);
    Result result;
    result.depth = min(za, zb);
#if MODE == 0
    result.color = a + (1.0 - a.a) * b;
#elif MODE == 1
    result.color = za <= zb ? a + (1.0 - a.a) * b : b + (1.0 - b.a) * a;
#elif MODE == 2
    result.color = min(a + b, 1.0);
#elif MODE == 3
    result.color = a * b + a * (1.0 - b.a) + b * (1.0 - a.a);
#else
    result.color = weight * a + (1.0 - weight) * b;
#endif
    return result;
}
