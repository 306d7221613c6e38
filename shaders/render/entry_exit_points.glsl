// Entry and exit distances, mm from the eye, of each ray through a convex region given by its planes.
#include "common/camera.glsl"
#include "common/interval.glsl"

#ifndef FRONT
#define FRONT 0         // 1: a picture lies before the region
#endif

const int MOST_PLANES = 64;

uniform Camera camera;                  // in the space of `planes`
uniform vec4 planes[64];                // unit normals outwards, offset: normal . p + offset <= 0 inside
uniform int count;
#if FRONT
field2 front;                           // linear premultiplied colour
field2 front_depth;                     // mm along the view axis
#endif

vec2 pixel(ivec2 at) {
    Ray ray = cast_ray(camera, at);
    vec2 range = vec2(-ray.start, 3.0e38);
    for (int i = 0; i < min(count, MOST_PLANES); ++i) {
        range = intersect_plane(ray.origin, ray.direction, planes[i], range);
    }
#if FRONT
    float depth = fetch2(front_depth, at).x;
    if (fetch2(front, at).w >= 1.0 && !isnan(depth)) {
        range.y = min(range.y, depth / ray.cosine - ray.start);
    }
#endif
    return count > 0 && range.y > range.x ? ray.start + range : vec2(0.0);
}
