// The transfer function of value and gradient magnitude as its areas: no table, so an edge is where it is, and a spike is
// as narrow as it is (nodegraph/data/areas.py). Points are (value, magnitude); the value is NaN where there is none.
#include "common/illumination.glsl"

field1 areas;           // four rows for each: see Area

struct Area {
    vec4 matter;        // linear RGB, extinction per mm
    vec4 bounds;        // least and greatest value, least and greatest magnitude
    vec4 shape;         // ends of the bottom, ends of the top; of a Gaussian its middle, and 1 / standard deviations
    vec4 edges;         // magnitude of the bottom, 1 / height, softness, 1 where the bottom may be soft
    bool bell;          // a Gaussian, and no trapezoid
};

const float END = 9.0;                          // a Gaussian ends at three standard deviations, squared here
const float FLOOR = 0.011108996538242306;       // what it has there
const float TINY = 1.0e-37;

Area area_of(int i) {
    vec4 edges = fetch1(areas, 4 * i + 3);
    return Area(
        fetch1(areas, 4 * i), fetch1(areas, 4 * i + 1), fetch1(areas, 4 * i + 2), edges, edges.z < 0.0);
}

#if SLOPES
// Value and gradient magnitude of a point of the ray.
vec2 spot_at(Ray ray, float t) {
    float value = value_at(ray, t, true);
    float magnitude = magnitude_of(slope_at(ray, t));
    return vec2(is_missing(value) || is_lost(magnitude) ? uintBitsToFloat(0x7fc00000u) : value, magnitude);
}
#endif

// Where a point is in a trapezoid: how far from its left and from its right side, and up from 0 at the bottom to 1 at the
// top. All three are linear in the point.
vec3 inside_of(Area area, vec2 at) {
    float up = (at.y - area.edges.x) * area.edges.y;
    return vec3(at.x - mix(area.shape.x, area.shape.z, up), mix(area.shape.y, area.shape.w, up) - at.x, up);
}

// Share of its extinction that a trapezoid has by how far up a point is.
float along_of(Area area, float up) {
    float along = min(area.edges.w > 0.0 ? up : 1.0, 1.0 - up) / max(0.5 * area.edges.z, TINY);
    return clamp(along, 0.0, 1.0);
}

// Share of its extinction that a trapezoid has at a point that is not outside.
float trapezoid_weight(Area area, vec3 inside) {
    float soft = 0.5 * area.edges.z;
    float across = min(inside.x, inside.y) / max(soft * (inside.x + inside.y), TINY);
    return soft > 0.0 ? clamp(across, 0.0, 1.0) * along_of(area, inside.z) : 1.0;
}

float bell_weight(float square) {
    return square < END ? (exp(-0.5 * square) - FLOOR) / (1.0 - FLOOR) : 0.0;
}

// Place in standard deviations about the middle of a Gaussian.
vec2 deviation_of(Area area, vec2 at) {
    return (at - area.shape.xy) * area.shape.zw;
}

float weight_of(Area area, vec2 at) {
    if (area.bell) {
        vec2 off = deviation_of(area, at);
        return bell_weight(dot(off, off));
    }
    vec3 inside = inside_of(area, at);
    bool outside = min(min(inside.x, inside.y), min(inside.z, 1.0 - inside.z)) < 0.0;
    return outside ? 0.0 : trapezoid_weight(area, inside);
}

// Colour and extinction per mm of a sum of colours times extinction, and extinctions.
vec4 matter_of(vec4 sum) {
    return vec4(sum.w > 0.0 ? sum.rgb / sum.w : vec3(0.0), sum.w);
}

// Colour times extinction, and extinction, of an area at a point.
vec4 matter_in(Area area, vec2 at) {
    float extinction = weight_of(area, at) * area.matter.w;
    return vec4(area.matter.rgb * extinction, extinction);
}

// What is left of a part (from, to) of a line on which something goes evenly from a to b, where that is not below 0.
vec2 cut_to(vec2 part, float a, float b) {
    float zero = a / (a - b);
    float from = a < 0.0 ? b < 0.0 ? 2.0 : max(part.x, zero) : part.x;
    float to = b < 0.0 ? a < 0.0 ? -1.0 : min(part.y, zero) : part.y;
    return vec2(from, to);
}

// Where on the line it passes 0; 0 where it does not.
float zero_of(float a, float b) {
    return (a < 0.0) == (b < 0.0) ? 0.0 : a / (a - b);
}

// Integral of the weight of a soft trapezoid over a part of a line on which it has no kink.
float trapezoid_part(Area area, vec3 a, vec3 b, float from, float to) {
    float length = to - from;
    if (!(length > 0.0)) {
        return 0.0;
    }
    float s = from + 0.5 * length;
    vec3 front = mix(a, b, from);
    vec3 back = mix(a, b, to);
    vec3 middle = mix(a, b, s);
    float soft = 0.5 * area.edges.z;
    float w0 = max(front.x + front.y, TINY);
    float w1 = max(back.x + back.y, TINY);
    bool whole = min(middle.x, middle.y) >= soft * (middle.x + middle.y);
    if (whole || max(w0, w1) < 1.25 * min(w0, w1)) {
        // A product of two linear functions, or so near to it that three points of Gauss and Legendre err by 1e-8.
        float off = 0.3872983346207417 * length;
        float ends = trapezoid_weight(area, mix(a, b, s - off)) + trapezoid_weight(area, mix(a, b, s + off));
        return length * (5.0 * ends + 8.0 * trapezoid_weight(area, middle)) / 18.0;
    }
    // Towards the tip of a triangle the width w vanishes, by which a slope is divided: (n0 + n1 w) (g0 + g1 w) / w.
    bool left = middle.x < middle.y;
    float n = left ? front.x : front.y;
    float g = along_of(area, front.z);
    float n1 = ((left ? back.x : back.y) - n) / (w1 - w0);
    float g1 = (along_of(area, back.z) - g) / (w1 - w0);
    float n0 = n - n1 * w0;
    float g0 = g - g1 * w0;
    float sum = n0 * g0 * log(w1 / w0) / (w1 - w0) + n0 * g1 + n1 * g0 + 0.5 * n1 * g1 * (w0 + w1);
    return max(length * sum / soft, 0.0);
}

// Mean weight of a trapezoid on the straight line between two points.
float trapezoid_share(Area area, vec2 front, vec2 back) {
    vec3 a = inside_of(area, front);
    vec3 b = inside_of(area, back);
    vec2 part = cut_to(cut_to(vec2(0.0, 1.0), a.x, b.x), a.y, b.y);
    part = cut_to(cut_to(part, a.z, b.z), 1.0 - a.z, 1.0 - b.z);
    float soft = 0.5 * area.edges.z;
    float share = max(part.y - part.x, 0.0);
    if (soft > 0.0 && share > 0.0) {
        // Its weight has a kink where a slope ends, at four places at most.
        vec4 cuts = vec4(
            zero_of(a.x - soft * (a.x + a.y), b.x - soft * (b.x + b.y)),
            zero_of(a.y - soft * (a.x + a.y), b.y - soft * (b.x + b.y)),
            zero_of(a.z - soft, b.z - soft), zero_of(1.0 - a.z - soft, 1.0 - b.z - soft));
        cuts = clamp(cuts, part.x, part.y);
        vec2 low = min(cuts.xz, cuts.yw);
        vec2 high = max(cuts.xz, cuts.yw);
        vec2 middle = vec2(max(low.x, low.y), min(high.x, high.y));
        vec4 ends = vec4(
            min(low.x, low.y), min(middle.x, middle.y), max(middle.x, middle.y), max(high.x, high.y));
        share = trapezoid_part(area, a, b, part.x, ends.x) + trapezoid_part(area, a, b, ends.x, ends.y) +
            trapezoid_part(area, a, b, ends.y, ends.z) + trapezoid_part(area, a, b, ends.z, ends.w) +
            trapezoid_part(area, a, b, ends.w, part.y);
    }
    return share;
}

// What a Gaussian has at two points of a line, `off` before and behind its `middle`: both from where it comes nearest.
float bell_pair(float middle, float off, float away, float square) {
    float less = away + (middle - off) * (middle - off) * square;
    float more = away + (middle + off) * (middle + off) * square;
    return exp(-0.5 * less) + exp(-0.5 * more) - 2.0 * FLOOR;
}

// Mean weight of a Gaussian on the straight line between two points: ten points of Gauss and Legendre inside of its end.
float bell_share(Area area, vec2 front, vec2 back) {
    vec2 a = deviation_of(area, front);
    vec2 way = deviation_of(area, back) - a;
    float square = dot(way, way);
    bool still = square < 1.0e-20;
    float across = a.x * way.y - a.y * way.x;
    float away = still ? dot(a, a) : across * across / square;  // of the line from the middle, squared
    if (!(away < END)) {
        return 0.0;
    }
    float nearest = still ? 0.5 : -dot(a, way) / square;
    float reach = still ? 0.5 : sqrt((END - away) / square);
    float from = clamp(nearest - reach, 0.0, 1.0);
    float to = clamp(nearest + reach, 0.0, 1.0);
    float middle = 0.5 * (from + to) - nearest;
    float radius = 0.5 * (to - from);
    float sum = 0.29552422471475287 * bell_pair(middle, 0.14887433898163122 * radius, away, square) +
        0.26926671930999635 * bell_pair(middle, 0.4333953941292472 * radius, away, square) +
        0.21908636251598204 * bell_pair(middle, 0.6794095682990244 * radius, away, square) +
        0.1494513491505806 * bell_pair(middle, 0.8650633666889845 * radius, away, square) +
        0.06667134430868814 * bell_pair(middle, 0.9739065285171717 * radius, away, square);
    return max(radius * sum / (1.0 - FLOOR), 0.0);
}

float share_of(Area area, vec2 front, vec2 back) {
    vec2 low = min(front, back);
    vec2 high = max(front, back);
    if (high.x < area.bounds.x || low.x > area.bounds.y || high.y < area.bounds.z || low.y > area.bounds.w) {
        return 0.0;
    }
    if (area.bell) {
        return bell_share(area, front, back);
    }
    return trapezoid_share(area, front, back);
}

// Mean colour and extinction where value and magnitude go evenly from one point to the other; nothing where one of them
// is missing.
vec4 mean_by_areas(vec2 front, vec2 back) {
    if (isnan(front.x) || isnan(back.x)) {
        return vec4(0.0);
    }
    vec4 sum = vec4(0.0);
    int count = size1(areas) / 4;
    for (int i = 0; i < count; ++i) {
        Area area = area_of(i);
        float extinction = share_of(area, front, back) * area.matter.w;
        sum += vec4(area.matter.rgb * extinction, extinction);
    }
    return matter_of(sum);
}

// What is known of an area where value and magnitude are within some bounds.
struct Known {
    float least;        // weight
    float most;
    bool even;          // no kink and no jump in between
};

float least_of(vec4 v) {
    return min(min(v.x, v.y), min(v.z, v.w));
}

float most_of(vec4 v) {
    return max(max(v.x, v.y), max(v.z, v.w));
}

bool passes_0(vec4 v) {
    return least_of(v) < 0.0 && most_of(v) > 0.0;
}

Known known_of_trapezoid(Area area, vec2 low, vec2 high) {
    // At the four corners, since all that is linear is greatest and least there.
    vec4 values = vec4(low.x, high.x, low.x, high.x);
    vec4 up = (vec4(low.y, low.y, high.y, high.y) - area.edges.x) * area.edges.y;
    vec4 left = values - (area.shape.x + (area.shape.z - area.shape.x) * up);
    vec4 right = (area.shape.y + (area.shape.w - area.shape.y) * up) - values;
    float soft = 0.5 * area.edges.z;
    float up_least = least_of(up);
    float up_most = most_of(up);
    if (most_of(left) < 0.0 || most_of(right) < 0.0 || up_most < 0.0 || up_least > 1.0) {
        return Known(0.0, 0.0, true);
    }
    bool inside = least_of(left) >= 0.0 && least_of(right) >= 0.0 && up_least >= 0.0 && up_most <= 1.0;
    if (!(soft > 0.0)) {
        return Known(inside ? 1.0 : 0.0, 1.0, inside);
    }
    bool ends = area.edges.w > 0.0;     // a slope at the bottom
    vec4 widths = soft * (left + right);
    bool kink = passes_0(left - widths) || passes_0(right - widths) || (ends && up_least < soft && up_most > soft) ||
        (up_least < 1.0 - soft && up_most > 1.0 - soft);
    float across = min(least_of(left), least_of(right)) / max(most_of(widths), TINY);
    float along = min(ends ? up_least : 1.0, 1.0 - up_most) / soft;
    float across_most = min(most_of(left), most_of(right)) / max(least_of(widths), TINY);
    float along_most = min(ends ? up_most : 1.0, 1.0 - up_least) / soft;
    return Known(
        clamp(across, 0.0, 1.0) * clamp(along, 0.0, 1.0), clamp(across_most, 0.0, 1.0) * clamp(along_most, 0.0, 1.0),
        inside && !kink);
}

Known known_of(Area area, vec2 low, vec2 high) {
    if (high.x < area.bounds.x || low.x > area.bounds.y || high.y < area.bounds.z || low.y > area.bounds.w) {
        return Known(0.0, 0.0, true);
    }
    if (!area.bell) {
        return known_of_trapezoid(area, low, high);
    }
    vec2 a = deviation_of(area, low);
    vec2 b = deviation_of(area, high);
    vec2 near = clamp(vec2(0.0), a, b);
    vec2 far = max(abs(a), abs(b));
    float least = dot(near, near);
    float most = dot(far, far);
    return Known(bell_weight(most), bell_weight(least), !(least < END && most > END));
}
