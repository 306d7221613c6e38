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

// Where some of the points have no value, what the others have ends somewhere between.
Means means_of(Place front, Place middle, Place back) {
    float missed = 0.0;
    if (isnan(front.value) || isnan(middle.value) || isnan(back.value)) {
        missed = isnan(front.value) ? missed : front.matter.w;
        missed = isnan(middle.value) ? missed : max(missed, middle.matter.w);
        missed = isnan(back.value) ? missed : max(missed, back.matter.w);
    } else {
        missed = missed_between(front, middle, back);
    }
    return Means(between(front, middle), between(middle, back), between(front, back), missed);
}

#include "common/halving.glsl"
