// Emission and absorption along the rays through a scalar volume, classified by value and gradient magnitude, with as many
// samples as each segment needs. What lies between two of them is summed by the areas, so that a part on which both go
// evenly needs no halving whatever the transfer function.
#define BY_GRADIENT 1
#include "common/areas.glsl"
#include "common/means.glsl"

struct Place {
    vec2 at;            // value, NaN where the volume has none, and gradient magnitude
};

// Weight of an area at a point; nothing where it has no value.
float weight_at(Area area, Place place) {
    return isnan(place.at.x) ? 0.0 : weight_of(area, place.at);
}

Place place_at(Ray ray, float t) {
    return Place(spot_at(ray, t));
}

// An area that neither half meets may still be passed by: value and magnitude go beyond the three points by half the bend,
// as far as a parabola gets, or a line with one kink. Where some of the points have no value, what the others have ends
// somewhere between.
Means means_of(Place front, Place middle, Place back) {
    vec4 near = vec4(0.0);
    vec4 far = vec4(0.0);
    vec4 whole = vec4(0.0);
    float missed = 0.0;
    bool first = !(isnan(front.at.x) || isnan(middle.at.x));
    bool second = !(isnan(middle.at.x) || isnan(back.at.x));
    bool both = !(isnan(front.at.x) || isnan(back.at.x));
    vec2 bend = 4.0 * abs(middle.at - 0.5 * (front.at + back.at));
    vec2 low = min(middle.at, min(front.at, back.at)) - bend;
    vec2 high = max(middle.at, max(front.at, back.at)) + bend;
    bool all = first && second;
    int count = size1(areas) / 4;
    for (int i = 0; i < count; ++i) {
        Area area = area_of(i);
        vec4 matter = vec4(area.matter.rgb, 1.0) * area.matter.w;
        float a = first ? share_of(area, front.at, middle.at) : 0.0;
        float b = second ? share_of(area, middle.at, back.at) : 0.0;
        near += a * matter;
        far += b * matter;
        whole += (both ? share_of(area, front.at, back.at) : 0.0) * matter;
        if (!all) {
            missed += max(weight_at(area, front), max(weight_at(area, middle), weight_at(area, back))) * area.matter.w;
        } else if (!(a > 0.0 || b > 0.0)) {
            missed += known_of(area, low, high).most * area.matter.w;
        }
    }
    return Means(matter_of(near), matter_of(far), matter_of(whole), missed);
}

#include "common/halving.glsl"
