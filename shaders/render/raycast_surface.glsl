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
    Leaper leaper = leaper_of(ray.origin - bricks_corner(), ray.direction, step_length);
#endif
    float below = surface(ray, before);
    bool hit = below >= 0.0;
    float found = before;
    float k = first;
    while (k <= end && !hit) {
#if SKIP
        float next = leap(bricks, leaper, k, k > first ? max(end - 1.0, k) : k);
        if (next > k) {
            // What lies between is outside; the search goes on from the last point of it.
            k = next;
            before = clamp((k - 0.5) * step_length, range.x, range.y);
            below = surface(ray, before);
        }
        float stop = k + 4.0;
#else
        float stop = end + 1.0;
#endif
        while (k < stop && k <= end && !hit) {
            float t = clamp((k + 0.5) * step_length, range.x, range.y);
            float above = surface(ray, t);
            if (above >= 0.0) {
                hit = true;
                found = isnan(below) ? t : refine(ray, before, t, below, above);
            }
            before = t;
            below = above;
            k += 1.0;
        }
    }
    if (hit) {
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
