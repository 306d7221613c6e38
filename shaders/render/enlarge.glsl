// A smaller picture of the same view, brought to the size that was asked for.
//
// Both have the camera's axis in their middle and the same height of view.
field2 color;       // RGBA, premultiplied
field2 depth;       // mm
uniform vec2 full;  // size of the large picture, pixels

struct Result {
    vec4 color;
    float depth;
};

Result pixel(ivec2 at) {
    vec2 small = vec2(size2(color));
    vec2 place = (vec2(at) + 0.5 - 0.5 * full) * (small.y / full.y) + 0.5 * small - 0.5;
    // A depth between two surfaces would be nobody's, so it is that of the nearest pixel.
    return Result(sample2(color, place), fetch2(depth, ivec2(round(place))).x);
}
