// Ray-casting of one scalar volume on the lattice of the eye: sample k lies at (k + 1/2) step along the ray, counted
// from the ray's origin, which the host puts a whole number of steps from the eye.
#include "common/camera.glsl"
#include "common/interval.glsl"
#include "common/classify.glsl"
#include "common/gradient.glsl"
#include "common/shading.glsl"

#ifndef MODE
#define MODE 0          // 0 composite, 1 maximum, 2 first hit, 3 iso
#endif
#ifndef LIT
#define LIT 0           // Phong illumination
#endif
#ifndef GRADIENT
#define GRADIENT 0      // 1: a volume of world-space gradients is bound; 0: central differences on the fly
#endif
#ifndef INTERVAL
#define INTERVAL 0      // 1: entry and exit points come as an image
#endif
#ifndef TERMINATION
#define TERMINATION 0   // 1: a ray ends when its opacity reaches `termination`
#endif

const float FAR = 3.0e38;           // mm, farther than anything

field3 volume;
field1 table;
uniform vec2 lookup;
uniform Camera camera;              // in the index space of the volume
uniform float step_length;          // mm
#if GRADIENT
field3v gradient;
#endif
#if INTERVAL
field2 interval;
#endif
#if LIT
uniform Light light;
uniform Material material;
uniform mat3 to_eye;                // takes gradients (of index space, or of world space if bound) to eye space
#endif
#if TERMINATION
uniform float termination;
#define ENOUGH termination
#else
#define ENOUGH 2.0
#endif
#if MODE == 0
uniform float depth_opacity;        // depth is where this much is hidden
#endif
#if MODE == 1
uniform float reference_length;     // mm of material that the brightest value stands for
#endif
#if MODE == 2
uniform float hit_extinction;       // per mm
#endif
#if MODE == 3
uniform float iso_value;
uniform vec3 iso_color;
#endif

struct Result {
    vec4 color;     // linear, premultiplied
    float depth;    // mm along the view axis
};

vec3 point_at(Ray ray, float t) {
    return ray.origin + ray.direction * t;
}

#if MODE == 0
// Colour and extinction of sample k of the ray.
vec4 matter_at(Ray ray, float k) {
    return classify(table, lookup, sample3(volume, point_at(ray, (k + 0.5) * step_length)));
}
#endif

// Colour of a point of the ray after illumination.
vec3 shade(vec3 color, Ray ray, float t) {
#if LIT
    vec3 p = point_at(ray, t);
#if GRADIENT
    vec3 slope = transform(to_eye, sample3v(gradient, p).xyz);
#else
    vec3 slope = transform(to_eye, gradient_central(volume, p));
#endif
    return shade_phong(color, slope, ray.eye_origin + ray.eye_direction * t, ray.eye_direction, light, material);
#else
    return color;
#endif
}

#if MODE == 2 || MODE == 3
// Above zero inside the surface that is looked for, NaN where the volume has none.
float surface(Ray ray, float t) {
    float value = sample3(volume, point_at(ray, t));
#if MODE == 3
    return value - iso_value;
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
#endif

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, at);
    Result result;
    result.color = vec4(0.0);
    result.depth = nothing();
    vec2 range = vec2(-ray.start, FAR);
#if INTERVAL
    vec2 seen = fetch2(interval, at).xy;
    if (any(isnan(seen))) {
        return result;
    }
    // Widened by the rounding of single precision, so that a proxy that fills the volume ends where the volume does.
    range = max(seen, 0.0) * vec2(1.0 - 1.0e-6, 1.0 + 1.0e-6) - ray.start;
#endif
    range = intersect_box(ray.origin, ray.direction, vec3(-0.5), vec3(size3(volume)) - 0.5, range);
    if (!(range.y > range.x)) {
        return result;
    }
    int first = int(floor(range.x / step_length));
    int last = int(ceil(range.y / step_length));

#if MODE == 0
    vec3 color = vec3(0.0);
    float hidden = 0.0;
    // The sample in which `depth_opacity` is passed, and what was hidden before it.
    vec2 crossing = vec2(-FAR, 0.0);
    // Samples are counted in floats, which are exact up to 16 million: nothing has to be converted in the loop.
    float next = float(first);
    float end = float(last);
    while (next < end && hidden < ENOUGH) {
        float k = next;
        vec4 matter = matter_at(ray, k);
        next += 1.0;
#if LIT
        // Light is dear. Neighbouring rays, which run in step, first look each for its next visible sample, and
        // then all light theirs together.
        while (next < end && !(matter.w > 0.0)) {
            k = next;
            matter = matter_at(ray, k);
            next += 1.0;
        }
#endif
        if (matter.w > 0.0) {
            float start = max(k * step_length, range.x);
            float length = min(next * step_length, range.y) - start;
            float share = (1.0 - hidden) * -expm1(-matter.w * length);
            color += share * shade(matter.rgb, ray, (k + 0.5) * step_length);
            crossing = hidden <= depth_opacity ? vec2(k, hidden) : crossing;
            hidden += share;
        }
    }
    result.color = vec4(color, hidden);
    if (hidden >= depth_opacity && crossing.x > -FAR) {
        float start = max(crossing.x * step_length, range.x);
        float reach = log((1.0 - crossing.y) / (1.0 - depth_opacity)) / matter_at(ray, crossing.x).w;
        result.depth = (ray.start + start + clamp(reach, 0.0, step_length)) * ray.cosine;
    }
#endif

#if MODE == 1
    float best = -FAR;
    float best_t = 0.0;
    for (int k = first; k < last; ++k) {
        float t = (float(k) + 0.5) * step_length;
        float value = sample3(volume, point_at(ray, t));
        if (value > best) {
            best = value;
            best_t = t;
        }
    }
    if (best > -FAR) {
        vec4 matter = classify(table, lookup, best);
        float opacity = -expm1(-matter.w * reference_length);
        result.color = vec4(matter.rgb, 1.0) * opacity;
        if (opacity > 0.0) {
            result.depth = (ray.start + clamp(best_t, range.x, range.y)) * ray.cosine;
        }
    }
#endif

#if MODE == 2 || MODE == 3
    float before = range.x;
    float below = surface(ray, before);
    bool hit = below >= 0.0;
    float found = before;
    for (int k = first; k <= last && !hit; ++k) {
        float t = clamp((float(k) + 0.5) * step_length, range.x, range.y);
        float above = surface(ray, t);
        if (above >= 0.0) {
            hit = true;
            found = isnan(below) ? t : refine(ray, before, t, below, above);
        }
        before = t;
        below = above;
    }
    if (hit) {
#if MODE == 3
        vec3 matter = iso_color;
#else
        vec3 matter = classify(table, lookup, sample3(volume, point_at(ray, found))).rgb;
#endif
        result.color = vec4(shade(matter, ray, found), 1.0);
        result.depth = (ray.start + found) * ray.cosine;
    }
#endif
    return result;
}
