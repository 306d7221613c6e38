// A ray by segments, each of which is halved until two halves agree with the whole within the tolerance (Orhun 2004,
// OR-61). A kernel that includes this says before it what a `Place` of the ray is: `place_at` finds one, and `means_of` says what
// lies between three.
#include "common/means.glsl"
#include "common/bricks.glsl"
#include "common/emission.glsl"
#include "common/halves.glsl"

uniform float tolerance;            // of the colour and opacity of the whole ray

const float FINEST = 256.0;         // parts of a segment
const float FINEST_AT_JUMP = 4096.0;

Result pixel(ivec2 at) {
    Begun begun = begin(at);
    Ray ray = begun.ray;
    Result result = begun.result;
    vec2 range = begun.range;
    if (!(range.y > range.x)) {
        return result;
    }
    vec2 segments = segments_of(ray, range);
    float first = segments.x;
    float end = segments.y;
#if SKIP
    vec3 origin = ray.origin - bricks_corner();
    Leaper leaper = leaper_of(origin, ray.direction, step_length, vec2(0.0, 1.0), layers_of(bricks));
#endif
    float per_mm = tolerance / (range.y - range.x);

    vec3 color = result.color.rgb;
    float hidden = result.color.w;
    float found = -FAR;
    float k = first;
    while (k < end && hidden < ENOUGH) {
#if SKIP
        k = leap(bricks, leaper, k, end);
        float stop = min(k + 8.0, end);
#else
        float stop = end;
#endif
        Portion portion = Portion(0.0, 1.0);    // of segment k
        float a = max(k * step_length, range.x);
        Place front = place_at(ray, a);
        while (k < stop && hidden < ENOUGH) {
            float from = max(k * step_length, range.x);
            float length = min((k + 1.0) * step_length, range.y) - from;
            float part = length / portion.parts;
            a = from + portion.index * part;
            Place middle = place_at(ray, a + 0.5 * part);
            Place back = place_at(ray, portion.index + 1.0 < portion.parts ? a + part : min((k + 1.0) * step_length, range.y));
            Means means = means_of(front, middle, back);
            float d0 = means.near.w * 0.5 * part;
            float d1 = means.far.w * 0.5 * part;
            float rest = 1.0 - hidden;
            float share = -expm1(-d0);
            float second = (1.0 - share) * -expm1(-d1);
            float coarse = -expm1(-means.whole.w * part);
            vec3 near = share > 0.0 ? shade(means.near.rgb, ray, a + 0.25 * part) : vec3(0.0);
            vec3 far = second > 0.0 ? shade(means.far.rgb, ray, a + 0.75 * part) : vec3(0.0);
            vec3 whole = coarse > 0.0 ? shade(means.whole.rgb, ray, a + 0.5 * part) : vec3(0.0);
            vec3 error = share * near + second * far - coarse * whole;
            float worst = max(max(abs(error.x), abs(error.y)), max(abs(error.z), abs(share + second - coarse)));
            // A ray that grazes a jump may pass it between the points that are looked at: such places are few.
            float missed = means.missed * part;
            if ((portion.parts < FINEST && rest * worst > per_mm * part) ||
                (portion.parts < FINEST_AT_JUMP && rest * missed > 0.25 * tolerance)) {
                portion = halved(portion);
            } else {
                color += rest * (share * near + second * far);
                float after = hidden + rest * (share + second);
                if (found < -FAR * 0.5 && after >= depth_opacity && after > 0.0 && isinf(result.depth)) {
                    float wanted = log((1.0 - hidden) / (1.0 - depth_opacity));
                    found = wanted < d0
                        ? a + 0.5 * part * clamp(wanted / d0, 0.0, 1.0)
                        : a + 0.5 * part * (1.0 + clamp((wanted - d0) / d1, 0.0, 1.0));
                }
                hidden = after;
                front = back;
                portion = after(portion);
                if (portion.index >= portion.parts) {
                    portion = Portion(0.0, 1.0);
                    k += 1.0;
                }
            }
        }
    }
    result.color = vec4(color, hidden);
    if (k < end && hidden < ENOUGH) {
        result.color = vec4(uintBitsToFloat(0x7fc00000u));  // the driver ended the loop
    }
    if (found > -FAR) {
        result.depth = (ray.start + found) * ray.cosine;
    }
    return result;
}
