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
    Leaper leaper = leaper_of(ray.origin - bricks_corner(), ray.direction, step_length, vec2(0.5), 0.0);
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
        // Bricks in which nothing is greater than what is found already.
        bool searching = true;
        while (searching) {
            vec3 place = leaper.origin + k * leaper.along;
            vec3 brick = floor(place);
            float count = segments_within(leaper, place, brick, ONE_BRICK);
            bool lesser = count > 0.0 && !(fetch3v(bricks, ivec3(brick)).y > best);
            k = lesser ? min(k + count, end) : k;
            searching = lesser && k < end;
        }
#endif
        // Four samples in a row without a question; of those behind the last nothing is taken.
        vec4 here = vec4(k, k + 1.0, k + 2.0, k + 3.0);
        vec4 t = (here + 0.5) * step_length;
        vec4 values = vec4(
            sample3(volume, point_at(ray, t.x)), sample3(volume, point_at(ray, t.y)),
            sample3(volume, point_at(ray, t.z)), sample3(volume, point_at(ray, t.w)));
        for (int i = 0; i < 4; ++i) {
            bool greater = values[i] > best && here[i] < end && !is_missing(values[i]);
            best = greater ? values[i] : best;
            best_t = greater ? t[i] : best_t;
        }
        k += 4.0;
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
