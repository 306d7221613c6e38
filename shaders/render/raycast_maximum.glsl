// The greatest value along each ray through a scalar volume (Rezk-Salama 2001, R13).
#define SEARCHES_ALL 1
#include "common/rays.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"

#ifndef SKIP
#define SKIP 0          // 1: bricks that hold nothing greater than what was found are left out
#endif

field1 table;
uniform vec2 lookup;                // from a value to a place in the table
uniform float reference_length;     // mm of material that the brightest value stands for
#if CARRIED
field2 carried_best;
#endif
#if SKIP
field3v bricks;                     // least and greatest value of each brick
#endif

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, at);
    Result result;
    result.color = vec4(0.0);
    result.depth = nothing();
#if CARRIED
    result.best = fetch2(carried_best, at).xy;
#endif
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x)) {
        return result;
    }
    float first = floor(range.x / step_length);
    float end = ceil(range.y / step_length);
#if CARRIED
    vec2 own = segments_of_block(ray.origin, ray.direction, step_length);
    first = max(first, own.x);
    end = min(end, own.y + 1.0);
#endif
#if SKIP
    Leaper leaper = leaper_of(ray.origin - bricks_corner(), ray.direction, step_length);
#endif
    float best = -FAR;
    float best_t = 0.0;
#if CARRIED
    best = result.best.x;
    best_t = result.best.y;
#endif
    float k = first;
    while (k < end) {
#if SKIP
        float stop = k + 4.0;
        if (k > first && k < end - 1.0) {
            vec3 brick = floor(leaper.origin + k * leaper.along);
            float count = segments_within(leaper, k, brick, 1.0);
            if (count > 0.0 && !(fetch3v(bricks, ivec3(brick)).y > best)) {
                k = min(k + count, end - 1.0);
                stop = k;
            }
        }
#else
        float stop = end;
#endif
        while (k < stop && k < end) {
            float t = (k + 0.5) * step_length;
            float value = sample3(volume, point_at(ray, t));
#if FINITE
            bool greater = value > best;
#else
            bool greater = value > best && !is_missing(value);
#endif
            if (greater) {
                best = value;
                best_t = t;
            }
            k += 1.0;
        }
    }
#if CARRIED
    result.best = vec2(best, best_t);
#endif
    if (best > -FAR) {
        vec4 matter = classify(table, lookup, best);
        float opacity = -expm1(-matter.w * reference_length);
        result.color = vec4(matter.rgb, 1.0) * opacity;
        if (opacity > 0.0) {
            result.depth = (ray.start + clamp(best_t, range.x, range.y)) * ray.cosine;
        }
    }
    return result;
}
