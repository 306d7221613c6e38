// The transfer function as a table over pairs of values: what lies between two points of a ray on which the value goes
// evenly (Rezk-Salama 2001, X12; see nodegraph/data/preintegration.py).
#include "common/rays.glsl"
#include "common/classify.glsl"

field2 pairs;           // (front, back) to mean colour and extinction between them
uniform vec2 lookup;    // from a value to a place in the table

// Place in the table of a point's value, NaN where the volume has none.
float place_at(Ray ray, float t) {
    float value = sample3(volume, point_at(ray, t));
    float place = value * lookup.x + lookup.y;
#if !FINITE
    place = is_missing(value) ? uintBitsToFloat(0x7fc00000u) : place;
#endif
    return place;
}

// Mean colour and extinction between two places; nothing where one of them is missing.
vec4 between(float front, float back) {
#if !FINITE
    if (isnan(front) || isnan(back)) {
        return vec4(0.0);
    }
#endif
    return sample2(pairs, vec2(front, back));
}
