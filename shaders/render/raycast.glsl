// Emission and absorption along the rays through a scalar volume, segment by segment (docs/decisions/0007-rays.md).
#ifndef BY_GRADIENT
#define BY_GRADIENT 0   // 1: what is seen depends on the magnitude of the gradient, too; then gradients are per mm
#endif
#include "common/areas.glsl"
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"
#include "common/emission.glsl"
#include "common/gauss.glsl"
#include "common/pairs.glsl"

#ifndef INTEGRATOR
#define INTEGRATOR 0    // 0 midpoint, 1 trapezoid, 2 preintegrated, 3 Gauss-Legendre with ORDER points
#endif
#ifndef PHASES
#define PHASES 0        // 1: four neighbouring rays are cut into segments a quarter of a step apart
#endif
#ifndef ALL_LIT
#define ALL_LIT 0       // 1: light falls on all segments without a question: nearly all can be seen, or it costs little
#endif

#if BY_GRADIENT && INTEGRATOR != 2
field2 table;
uniform vec4 lookup_2d; // scale and offset from a value to a column of the table, and from a magnitude to a row
#elif INTEGRATOR != 2
field1 table;
#endif

// Groups of four segments whose sum is made apart before it is laid over the ray: rounding grows with their number and
// the number of runs, not with the number of samples.
const float RUN = 32.0;

struct Segment {
    vec3 color;     // of what is seen of it, before illumination
    float depth;    // optical depth
    vec4 back;      // what the next segment begins with
};

#if BY_GRADIENT && INTEGRATOR != 2
vec4 matter_at(Ray ray, float t, bool lit) {
    float value = value_at(ray, t, true);
    float column = value * lookup_2d.x + lookup_2d.y;
    // Gradients are dear, and the outermost columns are empty.
    if (is_missing(value) || column <= 0.0 || column >= float(size2(table).x - 1)) {
        return vec4(0.0);
    }
    float magnitude = magnitude_of(slope_at(ray, t));
    return is_lost(magnitude)
        ? vec4(0.0)
        : classify_2d(table, vec2(column, magnitude * lookup_2d.z + lookup_2d.w));
}
#elif INTEGRATOR != 2
vec4 matter_at(Ray ray, float t, bool lit) {
    return classify(table, lookup, value_at(ray, t, lit));
}
#endif

vec4 end_of_segment(Ray ray, float t) {
#if INTEGRATOR == 1
    return matter_at(ray, t, false);
#elif INTEGRATOR == 2 && BY_GRADIENT
    return vec4(spot_at(ray, t), 0.0, 0.0);
#elif INTEGRATOR == 2
    return vec4(place_at(ray, t));
#else
    return vec4(0.0);
#endif
}

#if INTEGRATOR == 3
struct Points {
    vec3 colors[ORDER];
    Seen seen;
};

Points points_of(Ray ray, float start, float length, bool lit) {
    Points points;
    float extinction[ORDER];
    for (int i = 0; i < ORDER; ++i) {
        vec4 matter = matter_at(ray, start + nodes[i] * length, lit);
        extinction[i] = matter.w;
        points.colors[i] = matter.rgb;
    }
    points.seen = see(extinction, length);
    return points;
}
#endif

// Segment k of a ray that ends at `stop`: `length` mm from `start`, and begins with `front`. `lit`: light follows.
Segment segment(Ray ray, float k, float start, float length, float stop, vec4 front, bool lit) {
    Segment result;
    result.back = front;
#if INTEGRATOR == 0
    vec4 matter = matter_at(ray, (k + 0.5) * step_length, lit);
    result.color = matter.rgb;
    result.depth = matter.w * length;
#endif
#if INTEGRATOR == 1
    vec4 back = matter_at(ray, min((k + 1.0) * step_length, stop), false);
    result.depth = 0.5 * (front.w + back.w) * length;
    float rest = back.w * exp(-result.depth);
    result.color = front.w + rest > 0.0 ? (front.rgb * front.w + back.rgb * rest) / (front.w + rest) : back.rgb;
    result.back = back;
#endif
#if INTEGRATOR == 2
    vec4 back = end_of_segment(ray, min((k + 1.0) * step_length, stop));
#if BY_GRADIENT
    vec4 matter = mean_by_areas(front.xy, back.xy);
#else
    vec4 matter = between(front.x, back.x);
#endif
    result.color = matter.rgb;
    result.depth = matter.w * length;
    result.back = back;
#endif
#if INTEGRATOR == 3
    Points points = points_of(ray, start, length, lit);
    result.depth = points.seen.depth;
    result.color = vec3(0.0);
    for (int i = 0; i < ORDER; ++i) {
        result.color += points.seen.shares[i] * points.colors[i];
    }
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
    // Where what is at the front cannot be seen, and the back is hidden to the last digit of its weight.
    return front.w + rest > 0.0 ? (near * front.w + far * rest) / (front.w + rest) : far;
#endif
#if INTEGRATOR == 2
    return shade(part.color, ray, start + 0.5 * length);
#endif
#if INTEGRATOR == 3
    vec3 sum = vec3(0.0);
    Points points = points_of(ray, start, length, true);
    for (int i = 0; i < ORDER; ++i) {
        sum += points.seen.shares[i] * shade(points.colors[i], ray, start + nodes[i] * length);
    }
    return sum;
#endif
}
#endif

struct Sum {
    vec3 color;
    float hidden;
};

// Lay a segment that comes behind under the sum.
Sum add(Sum sum, vec3 color, float depth) {
    if (depth > 0.0) {
        float share = (1.0 - sum.hidden) * -expm1(-depth);
        sum.color += share * color;
        sum.hidden += share;
    }
    return sum;
}

// Lengths of segments that would begin at `starts` if nothing cut them. From the whole step, which is exact.
vec4 lengths_of(vec4 starts, vec2 range) {
    vec4 nothing = vec4(0.0);
    vec4 before = max(range.x - starts, nothing);
    vec4 behind = max(starts + step_length - range.y, nothing);
    return max(step_length - before - behind, nothing);
}

// Four segments in a row, without a question.
struct Group {
    vec4 front;
    vec4 starts;
    vec4 lengths;
    Segment one;
    Segment two;
    Segment three;
    Segment four;
};

Group group_at(Ray ray, float k, float last, vec2 range, bool lit) {
    Group group;
    vec4 starts = vec4(k, k + 1.0, k + 2.0, k + 3.0) * step_length;
    group.lengths = lengths_of(starts, range);
    group.starts = max(starts, vec4(range.x));
    group.front = end_of_segment(ray, group.starts.x);
#if CARRIED
    // Those behind the last one belong to another block.
    group.lengths = mix(group.lengths, vec4(0.0), greaterThan(vec4(k, k + 1.0, k + 2.0, k + 3.0), vec4(last)));
#endif
    group.one = segment(ray, k, group.starts.x, group.lengths.x, range.y, group.front, lit);
    group.two = segment(ray, k + 1.0, group.starts.y, group.lengths.y, range.y, group.one.back, lit);
    group.three = segment(ray, k + 2.0, group.starts.z, group.lengths.z, range.y, group.two.back, lit);
    group.four = segment(ray, k + 3.0, group.starts.w, group.lengths.w, range.y, group.three.back, lit);
    return group;
}

#if SKIP
// Where an integrator looks in a segment: first and last. All points but the middle move where a segment is cut, and
// stay in it.
vec2 looked_at() {
#if INTEGRATOR == 0
    return vec2(0.5);
#else
    return vec2(0.0, 1.0);
#endif
}
#endif

#if PHASES
// A ray whose segments begin later, by what its place among four neighbours says.
Ray shifted(Ray ray, ivec2 at) {
    ivec2 place = at - at / 2 * 2;
    float shift = step_length * (place.x == place.y ? 0.25 * float(place.y) : 0.5 + 0.25 * float(place.y));
    ray.origin += ray.direction * shift;
    ray.start += shift;
    return ray;
}
#endif

// Where on a ray an optical depth is reached, in the group that begins with segment k and has such depths.
float place_of(float wanted, vec4 depths, float k, vec2 range) {
    float second = wanted - depths.x;
    float third = second - depths.y;
    float fourth = third - depths.z;
    // Rounding may leave a little more to be passed than there is.
    const float NEARLY = 1.0 - 1.0e-6;
    bool in_first = depths.x > 0.0 && depths.x >= wanted * NEARLY;
    bool in_second = depths.y > 0.0 && depths.y >= second * NEARLY;
    bool in_third = depths.z > 0.0 && depths.z >= third * NEARLY;
    float i = in_first ? 0.0 : in_second ? 1.0 : in_third ? 2.0 : 3.0;
    float left = in_first ? wanted : in_second ? second : in_third ? third : fourth;
    float depth = in_first ? depths.x : in_second ? depths.y : in_third ? depths.z : depths.w;
    float begin = (k + i) * step_length;
    float start = max(begin, range.x);
    // All of it where there is nothing, which is behind the last segment.
    float share = depth > 0.0 ? clamp(left / depth, 0.0, 1.0) : 1.0;
    return start + (min(begin + step_length, range.y) - start) * share;
}

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, picture_pixel(at));
#if PHASES
    ray = shifted(ray, picture_pixel(at));
#endif
    Result result = carried_result(at);
    if (result.color.w >= ENOUGH) {
        return result;
    }
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x)) {
        return result;
    }
    // Segments are counted in floats, which are exact up to 16 million: nothing has to be converted in the loop.
    vec2 segments = segments_of(ray, range);
    float first = segments.x;
    float last = segments.y - 1.0;
#if SKIP
    vec3 origin = ray.origin - bricks_corner();
    Leaper leaper = leaper_of(origin, ray.direction, step_length, looked_at(), layers_of(bricks));
    float k = leap(bricks, leaper, first, last + 1.0);
#else
    float k = first;
#endif

    // What is summed already, what is left to be hidden, and the run that is summed apart at present.
    Sum sum = Sum(result.color.rgb, result.color.w);
    float rest = 1.0 - sum.hidden;
    Sum run = Sum(vec3(0.0), 0.0);
    float groups = 0.0;
    float hidden = sum.hidden;
    // The group in which `depth_opacity` is passed: its first segment, what was hidden before it, its optical depths.
    vec2 crossing = vec2(0.0);
    vec4 crossed = vec4(0.0);
    // One loop and not one for each run: llvmpipe goes through the body of a loop once more after all have left it.
    while (k <= last && hidden < ENOUGH) {
#if LIT && !ALL_LIT
        // Light is dear. Neighbouring rays, which run in step, first look each for something visible, and then all
        // light theirs together.
        float begin = k;
        vec4 depths = vec4(0.0);
        bool searching = true;
        while (searching) {
            begin = k;
            Group group = group_at(ray, k, last, range, false);
            depths = vec4(group.one.depth, group.two.depth, group.three.depth, group.four.depth);
#if SKIP
            k = leap(bricks, leaper, k + 4.0, last + 1.0);
#else
            k += 4.0;
#endif
            searching = k <= last && !any(greaterThan(depths, vec4(0.0)));
        }
        crossed = hidden <= depth_opacity ? depths : crossed;
        crossing = hidden <= depth_opacity ? vec2(begin, hidden) : crossing;
        float i = depths.x > 0.0 ? 0.0 : depths.y > 0.0 ? 1.0 : depths.z > 0.0 ? 2.0 : depths.w > 0.0 ? 3.0 : 4.0;
        while (i < 4.0) {
            float at = begin + i;
            float start = max(at * step_length, range.x);
            float length = lengths_of(vec4(at * step_length), range).x;
            vec4 front = end_of_segment(ray, start);
            Segment part = segment(ray, at, start, length, range.y, front, true);
            run = add(run, light_on(ray, at, start, length, front, part), part.depth);
            i = i < 1.0 && depths.y > 0.0 ? 1.0 : i < 2.0 && depths.z > 0.0 ? 2.0 : i < 3.0 && depths.w > 0.0 ? 3.0 : 4.0;
        }
#else
        Group group = group_at(ray, k, last, range, true);
        vec4 depths = vec4(group.one.depth, group.two.depth, group.three.depth, group.four.depth);
        crossed = hidden <= depth_opacity ? depths : crossed;
        crossing = hidden <= depth_opacity ? vec2(k, hidden) : crossing;
#if LIT
        Group dark = group;
        group.one.color = light_on(ray, k, dark.starts.x, dark.lengths.x, dark.front, dark.one);
        group.two.color = light_on(ray, k + 1.0, dark.starts.y, dark.lengths.y, dark.one.back, dark.two);
        group.three.color = light_on(ray, k + 2.0, dark.starts.z, dark.lengths.z, dark.two.back, dark.three);
        group.four.color = light_on(ray, k + 3.0, dark.starts.w, dark.lengths.w, dark.three.back, dark.four);
#endif
        run = add(run, group.one.color, group.one.depth);
        run = add(run, group.two.color, group.two.depth);
        run = add(run, group.three.color, group.three.depth);
        run = add(run, group.four.color, group.four.depth);
#if SKIP
        k = leap(bricks, leaper, k + 4.0, last + 1.0);
#else
        k += 4.0;
#endif
#endif
        groups += 1.0;
        hidden = sum.hidden + rest * run.hidden;
        if (groups >= RUN) {
            sum.color += rest * run.color;
            sum.hidden = hidden;
            rest = 1.0 - hidden;
            run = Sum(vec3(0.0), 0.0);
            groups = 0.0;
        }
    }
    sum.color += rest * run.color;
    sum.hidden = hidden;
    result.color = vec4(sum.color, sum.hidden);
    if (sum.hidden >= depth_opacity && sum.hidden > 0.0 && isinf(result.depth)) {
        float wanted = log((1.0 - crossing.y) / (1.0 - depth_opacity));
        result.depth = (ray.start + place_of(wanted, crossed, crossing.x, range)) * ray.cosine;
    }
    return result;
}
