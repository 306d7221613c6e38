// What every integrator of emission and absorption shares: how a ray begins, when it may end, and where its depth is.
#include "common/rays.glsl"

#ifndef TERMINATION
#define TERMINATION 0   // 1: a ray ends when its opacity reaches `termination`
#endif

uniform float depth_opacity;        // depth is where this much is hidden
#if TERMINATION
uniform float termination;
#define ENOUGH termination
#else
#define ENOUGH 1.0      // nothing can be added to a ray that is hidden wholly
#endif

struct Begun {
    Ray ray;
    Result result;  // of what lies before this block
    vec2 range;     // mm, where the ray is to be followed: nowhere if exit <= entry
};

Begun begin(ivec2 at) {
    Ray ray = cast_ray(camera, picture_pixel(at));
    Result result = carried_result(at);
    return Begun(ray, result, result.color.w >= ENOUGH ? vec2(0.0) : visible_range(ray, at));
}
