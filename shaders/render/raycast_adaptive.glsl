// Emission and absorption along the rays through a scalar volume, with as many samples as each segment needs. What lies
// between two values is summed by the keys, so that a part on which the value goes evenly needs no halving whatever the
// transfer function.
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bands.glsl"
#include "common/means.glsl"

Place place_at(Ray ray, float t) {
    float value = sample3(volume, point_at(ray, t));
    Place place = place_of(value);
#if !FINITE
    place.value = is_missing(value) ? uintBitsToFloat(0x7fc00000u) : value;
#endif
    return place;
}

Means means_of(Place front, Place middle, Place back) {
    return Means(
        between(front, middle), between(middle, back), between(front, back), missed_between(front, middle, back));
}

#include "common/halving.glsl"
