// The first point of each ray where a scalar volume reaches a value, or an extinction; opaque.
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"

#ifndef ISO
#define ISO 1           // 1: reaches iso_value; 0: its extinction reaches hit_extinction
#endif

#if ISO
uniform float iso_value;
uniform vec3 iso_color;
#else
field1 table;
uniform vec2 lookup;                // from a value to a place in the table
uniform float hit_extinction;       // per mm
#endif

// Above zero inside the surface that is looked for, NaN where the volume has no value.
float surface(Ray ray, float t) {
    float value = sample3(volume, point_at(ray, t));
#if ISO
    return is_missing(value) ? uintBitsToFloat(0x7fc00000u) : value - iso_value;
#else
    return classify(table, lookup, value).w - hit_extinction;
#endif
}

// Root of `surface` between a (outside) and b (inside): bisection with a last step of false position.
float refine(Ray ray, float outside, float inside, float below, float above) {
    float a = outside;
    float b = inside;
    float fa = below;
    float fb = above;
    for (int i = 0; i < 10; ++i) {
        float middle = 0.5 * (a + b);
        float f = surface(ray, middle);
        if (f >= 0.0) {
            b = middle;
            fb = f;
        } else {
            a = middle;
            fa = f;
        }
    }
    float slope = fb - fa;
    return slope > 0.0 ? a + (b - a) * clamp(-fa / slope, 0.0, 1.0) : b;
}

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, picture_pixel(at));
    Result result = carried_result(at);
    if (result.color.w > 0.0) {
        return result;
    }
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x)) {
        return result;
    }
    // The surface is looked for at the entry, in the middle of each segment, and at the exit.
    float first = floor(range.x / step_length);
    float end = ceil(range.y / step_length);
    float before = range.x;
#if CARRIED
    vec2 own = segments_of_block(ray.origin, ray.direction, step_length);
    end = min(end, own.y);
    if (own.x > first) {
        // The last point of the block before is outside, or its ray would have ended there.
        first = own.x;
        before = clamp((first - 0.5) * step_length, range.x, range.y);
    }
    if (end < first) {
        return result;
    }
#endif
#if SKIP
    vec3 origin = ray.origin - bricks_corner();
    Leaper leaper = leaper_of(origin, ray.direction, step_length, vec2(0.5), layers_of(bricks));
#endif
    // Between `before`, outside, and `found`, inside, lies the surface; where it is exactly is asked behind the loop, since
    // llvmpipe would go through the bisection at every turn.
    bool hit = surface(ray, before) >= 0.0;
    float found = before;
    float k = first;
    while (k <= end && !hit) {
        // Four points in a row without a question; of those behind the last nothing is taken.
        vec4 here = vec4(k, k + 1.0, k + 2.0, k + 3.0);
        vec4 t = clamp((here + 0.5) * step_length, range.x, range.y);
        vec4 inside = vec4(surface(ray, t.x), surface(ray, t.y), surface(ray, t.z), surface(ray, t.w));
        inside = mix(inside, vec4(-1.0), greaterThan(here, vec4(end)));
        hit = any(greaterThanEqual(inside, vec4(0.0)));
        found = inside.x >= 0.0 ? t.x : inside.y >= 0.0 ? t.y : inside.z >= 0.0 ? t.z : t.w;
        before = inside.x >= 0.0 ? before : inside.y >= 0.0 ? t.x : inside.z >= 0.0 ? t.y : t.z;
        k += 4.0;
#if SKIP
        k = leap(bricks, leaper, k, max(end - 1.0, k));
#endif
        before = hit ? before : clamp((k - 0.5) * step_length, range.x, range.y);
    }
    if (hit) {
        if (found > before) {
            float below = surface(ray, before);
            found = isnan(below) ? found : refine(ray, before, found, below, surface(ray, found));
        }
#if ISO
        vec3 matter = iso_color;
#else
        vec3 matter = classify(table, lookup, sample3(volume, point_at(ray, found))).rgb;
#endif
        result.color = vec4(shade(matter, ray, found), 1.0);
        result.depth = (ray.start + found) * ray.cosine;
    }
    return result;
}
