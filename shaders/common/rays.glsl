// What all ray-casters share: the ray of a pixel inside the volume, cut into segments.
//
// Segment k is the part of the ray from k to k + 1 steps, counted from the ray's origin, which the host puts a whole
// number of steps from the eye. The first and the last segment are cut by the volume and by the interval.
#include "common/blocks.glsl"
#include "common/camera.glsl"
#include "common/interval.glsl"

#ifndef INTERVAL
#define INTERVAL 0      // 1: entry and exit points come as an image
#endif

#ifndef SPARSE
#define SPARSE 0        // 1: only some pixels are cast, those that are listed
#endif

const float FAR = 3.0e38;           // mm, farther than anything

field3 volume;
uniform Camera camera;              // in the index space of the volume
uniform float step_length;          // mm
#if INTERVAL
field2 interval;
uniform float rounding;     // relative, of the distances in it
#endif
#if SPARSE
field2 pixels;              // column and row in the picture of each pixel that is cast
#endif
struct Result {
    vec4 color;     // linear, premultiplied
    float depth;    // mm along the view axis
#if CARRIED && defined(SEARCHES_ALL)
    vec2 best;      // greatest value so far and where it is, mm from the ray's origin
#endif
};
#if CARRIED
#ifdef SEARCHES_ALL
field2 carried_best;
#else
field2 carried;                     // colour and depth of what lies before the block
field2 carried_depth;

#endif

vec3 whole_size() {
    return whole;
}

// Where the bricks that are bound begin.
vec3 bricks_corner() {
    return block_bricks;
}
#else
vec3 whole_size() {
    return vec3(size3(volume));
}

vec3 bricks_corner() {
    return vec3(0.0);
}
#endif

// Which pixel of the picture is cast.
ivec2 picture_pixel(ivec2 at) {
#if SPARSE
    return ivec2(fetch2(pixels, at).xy);
#else
    return at;
#endif
}

// What the blocks before this one left behind for a pixel; nothing where there are none.
Result carried_result(ivec2 at) {
    Result result;
    result.color = vec4(0.0);
    result.depth = nothing();
#if CARRIED
#ifdef SEARCHES_ALL
    result.best = fetch2(carried_best, at).xy;
#else
    result.color = fetch2(carried, at);
    result.depth = fetch2(carried_depth, at).x;
#endif
#endif
    return result;
}

// The first segment of a ray that is to be looked at, and the one behind the last.
vec2 segments_of(Ray ray, vec2 range) {
    vec2 segments = vec2(floor(range.x / step_length), ceil(range.y / step_length));
#if CARRIED
    vec2 own = segments_of_block(ray.origin, ray.direction, step_length);
    segments = vec2(max(segments.x, own.x), min(segments.y, own.y + 1.0));
#endif
    return segments;
}

// A point of the ray, in the index space of what is bound as `volume`.
vec3 point_at(Ray ray, float t) {
#if CARRIED
    return ray.origin + ray.direction * t - corner;
#else
    return ray.origin + ray.direction * t;
#endif
}

// Where the ray is inside the volume and its interval, mm from the ray's origin; nothing where exit <= entry.
vec2 visible_range(Ray ray, ivec2 at) {
    vec2 range = vec2(-ray.start, FAR);
#if INTERVAL
    vec2 seen = fetch2(interval, picture_pixel(at)).xy;
    if (any(isnan(seen))) {
        return vec2(0.0);
    }
    // Widened by the rounding of the device, so that a proxy that fills the volume ends where the volume does.
    range = max(seen, 0.0) * vec2(1.0 - rounding, 1.0 + rounding) - ray.start;
#endif
    return intersect_box(ray.origin, ray.direction, vec3(-0.5), whole_size() - 0.5, range);
}
