// Emission and absorption along the rays through a scalar volume, segment by segment (docs/decisions/0007-rays.md).
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"

#ifndef INTEGRATOR
#define INTEGRATOR 0    // 0 midpoint, 1 trapezoid, 2 preintegrated, 3 and 4 Gauss-Legendre with 2 and 3 points
#endif
#ifndef TERMINATION
#define TERMINATION 0   // 1: a ray ends when its opacity reaches `termination`
#endif
#ifndef SKIP
#define SKIP 0          // 1: runs of segments that cannot be seen are left out
#endif

#if INTEGRATOR == 2
field2 table;                       // (front, back) to mean colour and extinction between them
#else
field1 table;
#endif
uniform vec2 lookup;                // from a value to a place in the table
uniform float depth_opacity;        // depth is where this much is hidden
#if SKIP
field3 bricks;
#endif
#if TERMINATION
uniform float termination;
#define ENOUGH termination
#else
#define ENOUGH 1.0      // nothing can be added to a ray that is hidden wholly
#endif

// Segments whose sum is made apart before it is laid over the ray: rounding grows with their number and the number of
// runs, not with the number of samples.
const float LONGEST_RUN = 128.0;

struct Segment {
    vec3 color;     // of what is seen of it, before illumination
    float depth;    // optical depth
    vec4 back;      // what the next segment begins with
};

#if INTEGRATOR == 2
// Place in the table of a point's value, NaN where the volume has none.
vec4 end_of_segment(Ray ray, float t) {
    return vec4(sample3(volume, point_at(ray, t)) * lookup.x + lookup.y);
}
#else
vec4 matter_at(Ray ray, float t) {
    return classify(table, lookup, sample3(volume, point_at(ray, t)));
}

vec4 end_of_segment(Ray ray, float t) {
#if INTEGRATOR == 1
    return matter_at(ray, t);
#else
    return vec4(0.0);
#endif
}
#endif

#if INTEGRATOR == 3
const float NODE[2] = float[2](0.211324865405187118, 0.788675134594812882);
const float WEIGHT[2] = float[2](0.5, 0.5);
// Row i: what the length before node i weighs at each node, by the polynomial through them.
const float BEFORE[4] = float[4](0.25, -0.0386751345948128823, 0.538675134594812882, 0.25);
#define POINTS 2
#endif
#if INTEGRATOR == 4
const float NODE[3] = float[3](0.112701665379258311, 0.5, 0.887298334620741689);
const float WEIGHT[3] = float[3](0.277777777777777778, 0.444444444444444444, 0.277777777777777778);
const float BEFORE[9] = float[9](
    0.138888888888888889, -0.0359766675249389034, 0.00978944401530832604,
    0.300026000111286, 0.222222222222222222, -0.0224704445557304,
    0.26798833376246945, 0.480421111969383348, 0.138888888888888889);
#define POINTS 3
#endif

#if INTEGRATOR == 3 || INTEGRATOR == 4
struct Nodes {
    vec3 colors[POINTS];
    float weights[POINTS];      // of the colours in what is seen of the segment
    vec3 color;
    float depth;
};

// The points of a segment by Gauss and Legendre, as a collocation method: order 2 POINTS also for the colour.
Nodes look_at(Ray ray, float start, float length) {
    Nodes nodes;
    float extinction[POINTS];
    nodes.depth = 0.0;
    for (int i = 0; i < POINTS; ++i) {
        vec4 matter = matter_at(ray, start + NODE[i] * length);
        extinction[i] = matter.w;
        nodes.colors[i] = matter.rgb;
        nodes.depth += WEIGHT[i] * matter.w * length;
    }
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = 0; i < POINTS; ++i) {
        float before = 0.0;
        for (int j = 0; j < POINTS; ++j) {
            before += BEFORE[i * POINTS + j] * extinction[j];
        }
        nodes.weights[i] = WEIGHT[i] * extinction[i] * exp(-before * length);
        sum += nodes.weights[i] * nodes.colors[i];
        weights += nodes.weights[i];
    }
    nodes.color = weights > 0.0 ? sum / weights : nodes.colors[0];
    return nodes;
}
#endif

// Segment k of a ray that ends at `stop`: `length` mm from `start`, and begins with `front`.
Segment segment(Ray ray, float k, float start, float length, float stop, vec4 front) {
    Segment result;
    result.back = front;
#if INTEGRATOR == 0
    vec4 matter = matter_at(ray, (k + 0.5) * step_length);
    result.color = matter.rgb;
    result.depth = matter.w * length;
#endif
#if INTEGRATOR == 1
    vec4 back = matter_at(ray, min((k + 1.0) * step_length, stop));
    result.depth = 0.5 * (front.w + back.w) * length;
    float rest = back.w * exp(-result.depth);
    result.color = front.w + rest > 0.0 ? (front.rgb * front.w + back.rgb * rest) / (front.w + rest) : front.rgb;
    result.back = back;
#endif
#if INTEGRATOR == 2
    vec4 back = end_of_segment(ray, min((k + 1.0) * step_length, stop));
    vec4 matter = sample2(table, vec2(front.x, back.x));
#if !FINITE
    if (isnan(front.x) || isnan(back.x)) {
        matter = vec4(0.0);
    }
#endif
    result.color = matter.rgb;
    result.depth = matter.w * length;
    result.back = back;
#endif
#if INTEGRATOR == 3 || INTEGRATOR == 4
    Nodes nodes = look_at(ray, start, length);
    result.depth = nodes.depth;
    result.color = nodes.color;
#endif
    return result;
}

#if LIT
// Illuminated colour of a segment that can be seen.
vec3 light_on(Ray ray, float k, float start, float length, vec4 front, Segment part) {
#if INTEGRATOR == 0
    return shade(part.color, ray, (k + 0.5) * step_length);
#endif
#if INTEGRATOR == 1
    vec4 back = part.back;
    float rest = back.w * exp(-part.depth);
    vec3 near = shade(front.rgb, ray, start);
    vec3 far = shade(back.rgb, ray, start + length);
    return (near * front.w + far * rest) / (front.w + rest);
#endif
#if INTEGRATOR == 2
    return shade(part.color, ray, start + 0.5 * length);
#endif
#if INTEGRATOR == 3 || INTEGRATOR == 4
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    Nodes nodes = look_at(ray, start, length);
    for (int i = 0; i < POINTS; ++i) {
        sum += nodes.weights[i] * shade(nodes.colors[i], ray, start + NODE[i] * length);
        weights += nodes.weights[i];
    }
    return sum / weights;
#endif
}
#endif

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, at);
    Result result;
    result.color = vec4(0.0);
    result.depth = nothing();
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x)) {
        return result;
    }
    // Segments are counted in floats, which are exact up to 16 million: nothing has to be converted in the loop.
    float first = floor(range.x / step_length);
    float end = ceil(range.y / step_length);
    vec3 per_unit = inverse_of(ray.direction);

    vec3 color = vec3(0.0);
    float hidden = 0.0;
    // The segment in which `depth_opacity` is passed, and what was hidden before it.
    vec2 crossing = vec2(-FAR, 0.0);
    Run run = Run(first, first);
    while (run.stop < end && hidden < ENOUGH) {
        // The first and the last segment, which are shorter than the others, are runs of their own.
        run.first = run.stop;
        run.stop = run.first + 1.0;
        float start = max(run.first * step_length, range.x);
        float length = min(run.stop * step_length, range.y) - start;
        float ahead = start - run.first * step_length;
        if (run.first > first && run.stop < end) {
#if SKIP
            run = next_run(bricks, ray.origin, ray.direction, per_unit, step_length, run.first, end - 1.0);
            run.stop = min(run.stop, run.first + LONGEST_RUN);
#else
            run.stop = min(run.first + LONGEST_RUN, end - 1.0);
#endif
            length = step_length;
            ahead = 0.0;
        }
        // What the run hides and shows by itself, and how much of it settles the ray and its depth.
        vec3 run_color = vec3(0.0);
        float run_hidden = 0.0;
        float rest = 1.0 - hidden;
        float enough = (ENOUGH - hidden) / rest;
        float deep = (depth_opacity - hidden) / rest;
        vec2 passed = vec2(-FAR, 0.0);
        float k = run.first;
        vec4 back = end_of_segment(ray, k * step_length + ahead);
        while (k < run.stop && run_hidden < enough) {
            vec4 front = back;
            Segment part = segment(ray, k, k * step_length + ahead, length, range.y, front);
            back = part.back;
            k += 1.0;
#if LIT
            // Light is dear. Neighbouring rays, which run in step, first look each for its next visible segment, and
            // then all light theirs together.
            while (k < run.stop && !(part.depth > 0.0)) {
                front = back;
                part = segment(ray, k, k * step_length + ahead, length, range.y, front);
                back = part.back;
                k += 1.0;
            }
#endif
            if (part.depth > 0.0) {
                float share = (1.0 - run_hidden) * -expm1(-part.depth);
#if LIT
                run_color += share * light_on(ray, k - 1.0, (k - 1.0) * step_length + ahead, length, front, part);
#else
                run_color += share * part.color;
#endif
                passed = run_hidden <= deep ? vec2(k - 1.0, run_hidden) : passed;
                run_hidden += share;
            }
        }
        color += rest * run_color;
        if (hidden <= depth_opacity && passed.x > -FAR) {
            crossing = vec2(passed.x, hidden + rest * passed.y);
        }
        hidden += rest * run_hidden;
    }
    result.color = vec4(color, hidden);
    if (hidden >= depth_opacity && crossing.x > -FAR) {
        float a = max(crossing.x * step_length, range.x);
        float b = min((crossing.x + 1.0) * step_length, range.y);
        float depth = segment(ray, crossing.x, a, b - a, range.y, end_of_segment(ray, a)).depth;
        float share = log((1.0 - crossing.y) / (1.0 - depth_opacity)) / depth;
        result.depth = (ray.start + mix(a, b, clamp(share, 0.0, 1.0))) * ray.cosine;
    }
    return result;
}
