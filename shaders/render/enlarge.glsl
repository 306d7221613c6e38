// A smaller picture of the same view, brought to the size that was asked for.
//
// Both have the camera's axis in their middle and the same height of view.

#ifndef DEPTH
#define DEPTH 1         // 1: the picture has a depth, too
#endif

field2 color;       // RGBA, premultiplied
#if DEPTH
field2 depth;       // mm
#endif
uniform vec2 full;  // size of the large picture, pixels

struct Result {
    vec4 color;
#if DEPTH
    float depth;
#endif
};

Result pixel(ivec2 at) {
    vec2 small = vec2(size2(color));
    vec2 place = (vec2(at) + 0.5 - 0.5 * full) * (small.y / full.y) + 0.5 * small - 0.5;
    Result result;
    result.color = sample2(color, place);
#if DEPTH
    // A depth between two surfaces would be nobody's, so it is that of the nearest pixel.
    result.depth = fetch2(depth, ivec2(round(place))).x;
#endif
    return result;
}
