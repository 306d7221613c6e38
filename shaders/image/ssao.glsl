// Screen-space ambient occlusion: the share of a ball about each visible point that lies behind visible surfaces.
// All geometry is in eye space (x right, y up, z backwards, mm). The ball is cut into the rays of the pixels it covers.
#include "common/camera.glsl"
#include "common/hash.glsl"

#ifndef METHOD
#define METHOD 0            // 0 the half ball before the surface, 1 the whole ball
#endif
#ifndef EVERY_PIXEL
#define EVERY_PIXEL 0       // 1: all pixels that the ball covers; 0: `samples` of them
#endif

field2 image;
field2 depth;
uniform Camera camera;      // distances and eye space only; its own space is not used
uniform float radius;       // mm
uniform float thickness;    // mm along the ray
uniform float strength;
uniform float bleed;
uniform int samples;

struct Result {
    vec4 color;
    float occlusion;
};

// What the ball of a point is compared with.
struct Place {
    vec3 point;
    vec3 normal;            // unit vector, towards the viewer
    float distance;         // from the eye along the ray, mm
};

// Sums over the rays looked at.
struct Shade {
    float volume;           // of the ball
    float hidden;           // part of it
    vec4 tint;              // premultiplied colour of what hides, weighted by how much it does
};

bool is_inside(ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size2(depth)));
}

// What pixel `at` shows, and 1; or 0 in the fourth component where it shows nothing.
vec4 point_seen(ivec2 at) {
    if (!is_inside(at)) {
        return vec4(0.0);
    }
    float z = fetch2(depth, at).x;
    if (isinf(z) || isnan(z)) {
        return vec4(0.0);
    }
    Ray ray = cast_ray(camera, at);
    return vec4(ray.eye_origin + ray.eye_direction * (z / ray.cosine), 1.0);
}

// Along the surface from the point of pixel `at` in the direction `by`. Of the two neighbours the one that is nearer in
// depth lies more likely on the same surface. (0, 0, 0) where neither shows anything.
vec3 tangent(vec3 point, ivec2 at, ivec2 by) {
    vec4 next = point_seen(at + by);
    vec4 last = point_seen(at - by);
    vec3 forth = next.xyz - point;
    vec3 back = point - last.xyz;
    bool forwards = next.w > 0.0 && (last.w == 0.0 || abs(forth.z) <= abs(back.z));
    return forwards ? forth : back * last.w;
}

vec3 normal_at(vec3 point, vec3 view, ivec2 at) {
    vec3 normal = normalize(cross(tangent(point, at, ivec2(1, 0)), tangent(point, at, ivec2(0, 1))));
    if (dot(normal, normal) == 0.0) {
        return -view;       // a lone pixel faces the viewer
    }
    return dot(normal, view) > 0.0 ? -normal : normal;
}

// Volume of the part between low and high (mm, relative to the foot) of a ray that widens with distance; `widening` is
// one over the distance of the foot, 0 for parallel rays. The integral of (1 + s * widening)^2.
float volume_between(float low, float high, float widening) {
    float a = low * widening;
    float b = high * widening;
    return max(high - low, 0.0) * (1.0 + (a + b) + (a * a + a * b + b * b) / 3.0);
}

// Add the ray of pixel `at` to the sums.
Shade look(Shade shade, Place place, ivec2 at) {
    if (!is_inside(at)) {
        return shade;
    }
    Ray ray = cast_ray(camera, at);
    vec3 to_place = place.point - ray.eye_origin;
    float foot = dot(to_place, ray.eye_direction);      // where the ray passes the middle of the ball
    vec3 off = ray.eye_direction * foot - to_place;
    float half_chord = radius * radius - dot(off, off);
    if (!(half_chord > 0.0)) {
        return shade;
    }
    float high = sqrt(half_chord);
    float low = -high;
    float weight = 1.0;
    float widening = 0.0;
    if (!camera.orthographic) {
        low = max(low, -foot);                          // nothing lies behind the eye
        widening = 1.0 / foot;
        // Solid angle of a pixel times the square of the distance.
        weight = ray.cosine * ray.cosine * ray.cosine * (foot / place.distance) * (foot / place.distance);
    }
#if METHOD == 0
    // Only what lies before the plane through the point: normal . (off + s * direction) > 0.
    float rate = dot(place.normal, ray.eye_direction);
    float height = dot(place.normal, off);
    if (rate < 0.0) {
        high = min(high, -height / rate);
    } else if (rate > 0.0) {
        low = max(low, -height / rate);
    } else if (height <= 0.0) {
        return shade;
    }
#endif
    if (!(high > low)) {
        return shade;
    }
    shade.volume += weight * volume_between(low, high, widening);
    float z = fetch2(depth, at).x;
    if (isinf(z) || isnan(z)) {
        return shade;
    }
    float surface = z / ray.cosine - foot;
    float hidden = weight * volume_between(max(low, surface), min(high, surface + thickness), widening);
    shade.hidden += hidden;
    shade.tint += hidden * fetch2(image, at);
    return shade;
}

// Radius of the picture of the ball, pixels: at most, which is towards the border of the picture.
float reach_of(Place place, Ray ray) {
    float per_unit = 0.5 * camera.pixels.y / camera.half_size.y;
    float most = length(camera.pixels);
    if (camera.orthographic) {
        return min(radius * per_unit, most);
    }
    float away = place.distance * place.distance - radius * radius;
    if (!(away > 0.0)) {
        return most;
    }
    float half_angle = radius / sqrt(away);                                     // its tangent
    float slant = sqrt(max(1.0 - ray.cosine * ray.cosine, 0.0)) / ray.cosine;   // tangent of the angle off the middle
    float rest = 1.0 - slant * half_angle;
    return rest > 0.0 ? min(half_angle * (1.0 + slant * slant) / rest * per_unit, most) : most;
}

Result pixel(ivec2 at) {
    Result result;
    result.color = fetch2(image, at);
    vec4 seen = point_seen(at);
    if (seen.w == 0.0) {
        return result;
    }
    Ray ray = cast_ray(camera, at);
    Place place;
    place.point = seen.xyz;
    place.distance = length(seen.xyz - ray.eye_origin);
#if METHOD == 0
    place.normal = normal_at(place.point, ray.eye_direction, at);
#endif
    float reach = reach_of(place, ray);
    Shade shade;
#if EVERY_PIXEL
    ivec2 around = ivec2(ceil(vec2(reach)));
    ivec2 low = max(at - around, 0);
    ivec2 high = min(at + around, size2(depth) - 1);
#if METHOD == 1
    // The whole ball of a plane is half hidden only where each ray has its opposite.
    ivec2 both = min(at - low, high - at);
    low = at - both;
    high = at + both;
#endif
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            shade = look(shade, place, ivec2(x, y));
        }
    }
#else
    // Opposite points of a disc on a spiral of equal areas (Vogel 1979), half a turn of the golden section at a time since
    // each has its opposite; turned and pushed outwards by a hash of the pixel. Angles are counted in integers, so that
    // every device looks at the same pixels.
    float pairs = float((samples + 1) / 2);
    float push = unit_float(hash_pixel(at, 0u));
    uint turn = hash_pixel(at, 1u);
    for (int i = 0; i < samples; ++i) {
        int pair = i / 2;
        float angle = 6.283185307179586 * unit_float(turn + uint(pair) * 1327217885u);
        vec2 offset = reach * sqrt((float(pair) + push) / pairs) * vec2(cos(angle), sin(angle));
        ivec2 by = ivec2(floor(offset + 0.5));
        by = i % 2 == 0 ? by : -by;
#if METHOD == 1
        if (is_inside(at - by)) {
            shade = look(shade, place, at + by);
        }
#else
        shade = look(shade, place, at + by);
#endif
    }
#endif
    float share = shade.volume > 0.0 ? shade.hidden / shade.volume : 0.0;
#if METHOD == 1
    share = 2.0 * share - 1.0;
#endif
    result.occlusion = clamp(share, 0.0, 1.0);
    vec3 tint = shade.tint.a > 0.0 ? shade.tint.rgb / shade.tint.a : vec3(0.0);
    float lost = strength * result.occlusion;
    result.color = vec4((1.0 - lost) * result.color.rgb + lost * bleed * result.color.a * tint, result.color.a);
    return result;
}
