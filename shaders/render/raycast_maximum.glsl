// The greatest value along each ray through a scalar volume (Rezk-Salama 2001, R13).
#define SEARCHES_ALL 1
#include "common/rays.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"


field1 table;
uniform vec2 lookup;                // from a value to a place in the table
uniform float reference_length;     // mm of material that the brightest value stands for

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, picture_pixel(at));
    Result result = carried_result(at);
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x)) {
        return result;
    }
    vec2 segments = segments_of(ray, range);
    float first = segments.x;
    float end = segments.y;
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
