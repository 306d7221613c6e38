// Emission and absorption along the rays through a scalar volume, cut where anything has a kink: at the faces of cells,
// where the cubic that the value is inside a cell turns, and where it meets a key of the transfer function. Each piece
// is smooth, and Gauss-Legendre points integrate it (docs/decisions/0007-rays.md).
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"
#include "common/cubic.glsl"
#include "common/gauss.glsl"
#include "common/halves.glsl"
#include "common/pieces.glsl"

field1 keys;                        // linear RGB and extinction per mm of each key
field1 places;                      // value of each key, ascending; two at one value make a step

// Colour and extinction between two keys, where both are linear in the value.
struct Band {
    vec4 near;      // at the value `from`
    vec4 far;       // `width` above it
    float from;
    float width;
};

// The band above a key; -1: below the first, where the first goes on.
Band band_above(int key) {
    int count = size1(places);
    int low = clamp(key, 0, count - 1);
    int high = key < 0 ? 0 : clamp(key + 1, 0, count - 1);
    float from = fetch1(places, low).x;
    return Band(fetch1(keys, low), fetch1(keys, high), from, fetch1(places, high).x - from);
}

vec4 matter_in(Band band, float value) {
    return mix(band.near, band.far, band.width > 0.0 ? clamp((value - band.from) / band.width, 0.0, 1.0) : 0.0);
}

// The cubic from s0 to s1 of the cell [start, start + length] mm, by Gauss and Legendre as a collocation method.
Piece integrate(Ray ray, Cubic f, Band band, float s0, float s1, float start, float length) {
    float piece = (s1 - s0) * length;
    vec4 matter[ORDER];
    float extinction[ORDER];
    for (int i = 0; i < ORDER; ++i) {
        matter[i] = matter_in(band, value_of(f, mix(s0, s1, nodes[i])));
        extinction[i] = matter[i].w;
    }
    Seen seen = see(extinction, piece);
    vec3 color = vec3(0.0);
    for (int i = 0; i < ORDER; ++i) {
        float t = start + (mix(s0, s1, nodes[i]) + 0.5) * length;
        color += seen.shares[i] * shade(matter[i].rgb, ray, t);
    }
    return Piece(color, seen.depth);
}

// What one smooth piece adds.
Sum add_piece(Sum sum, Ray ray, Cubic f, Band band, float s0, float s1, float start, float length) {
    Sum result = sum;
    // Where the gradient nearly vanishes its direction swings, and light with it: portions are halved until halves and
    // whole agree.
    Portion portion = Portion(0.0, 1.0);
    while (portion.index < portion.parts) {
        float a = mix(s0, s1, portion.index / portion.parts);
        float b = mix(s0, s1, (portion.index + 1.0) / portion.parts);
        Piece whole = integrate(ray, f, band, a, b, start, length);
        Sum next = add(result, whole);
        bool fine = true;
#if LIT
        float middle = 0.5 * (a + b);
        Sum halves = add(result, integrate(ray, f, band, a, middle, start, length));
        halves = add(halves, integrate(ray, f, band, middle, b, start, length));
        vec3 error = abs(next.color - halves.color);
        next = halves;
        fine = max(error.x, max(error.y, error.z)) < AGREED || portion.parts >= MOST_PARTS;
#endif
        if (fine) {
            if (result.depth == NEVER && next.hidden >= depth_opacity && whole.depth > 0.0) {
                float e0 = matter_in(band, value_of(f, a)).w;
                float e1 = matter_in(band, value_of(f, b)).w;
                float reach = reached(result, whole.depth, e0, e1);
                next.depth = start + (mix(a, b, reach) + 0.5) * length;
            }
            result = next;
        }
        portion = fine ? after(portion) : halved(portion);
    }
    return result;
}

// What one cell adds, cut where the cubic turns and where it meets keys.
Sum add_cell(Sum sum, Ray ray, float start, float length) {
    Sum result = sum;
    vec4 v = vec4(
        sample3(volume, point_at(ray, start + 0.125 * length)), sample3(volume, point_at(ray, start + 0.375 * length)),
        sample3(volume, point_at(ray, start + 0.625 * length)), sample3(volume, point_at(ray, start + 0.875 * length)));
#if !FINITE
    if (any(isnan(v)) || any(isinf(v))) {
        return result;
    }
#endif
    Cubic f = cubic_through(v);
#if LIT
    // Light jumps where the surface turns its other side to the viewer, and has a kink where it turns from the lamp.
    Cubic facing = cubic_through(vec4(0.0));
    Cubic shadow = facing;
    bool known = false;
#endif
    vec2 turns = turns_of(f);
    int count = size1(places);
    float s = -0.5;
    for (int part = 0; part < 3; ++part) {
        float stop = part == 0 ? turns.x : part == 1 ? turns.y : 0.5;
        float value = value_of(f, s);
        float goal = value_of(f, stop);
        bool rising = goal > value;
        // The key at or below the value from which the piece leaves.
        int key = -1;
        int above = count;
        while (above - key > 1) {
            int middle = (key + above) / 2;
            float place = fetch1(places, middle).x;
            bool below = place < value || (place == value && goal >= value);
            key = below ? middle : key;
            above = below ? above : middle;
        }
        bool going = s < stop && result.hidden < ENOUGH;
        while (going) {
            int meets = rising ? key + 1 : key;
            float place = fetch1(places, clamp(meets, 0, count - 1)).x;
            bool inside = meets >= 0 && meets < count && (rising ? place < goal : place > goal);
            float end = inside ? root_of(f, place, s, stop) : stop;
            bool at_key = inside;
            Band band = band_above(key);
            bool seen = end > s && (band.near.w > 0.0 || band.far.w > 0.0);
#if LIT
            if (seen) {
                if (!known) {
                    vec4 a;
                    vec4 b;
                    for (int i = 0; i < 4; ++i) {
                        float t = start + (0.125 + 0.25 * float(i)) * length;
                        vec3 slope = slope_at(ray, t);
                        vec3 lamp = light.position - (light.directional ? vec3(0.0) : ray.eye_origin + ray.eye_direction * t);
                        a[i] = dot(slope, ray.eye_direction);
                        b[i] = dot(slope, lamp);
                    }
                    facing = cubic_through(a);
                    shadow = cubic_through(b);
                    known = true;
                }
                float turned = min(next_zero(facing, s, end), next_zero(shadow, s, end));
                at_key = at_key && !(turned < end);
                end = turned;
            }
#endif
            if (seen) {
                result = add_piece(result, ray, f, band, s, end, start, length);
            }
            going = (at_key || end < stop) && result.hidden < ENOUGH;
            s = max(s, end);
            key = at_key ? rising ? key + 1 : key - 1 : key;
        }
        s = max(s, stop);
    }
    return result;
}

#include "common/cells.glsl"
