// Emission and absorption along the rays through a scalar volume, cut where anything has a kink: at the faces of cells,
// where the cubic that the value is inside a cell turns, and where it meets a key of the transfer function. Each piece
// is smooth, and Gauss-Legendre points integrate it (docs/decisions/0007-rays.md).
#include "common/illumination.glsl"
#include "common/classify.glsl"
#include "common/bricks.glsl"
#include "common/emission.glsl"
#include "common/gauss.glsl"

field1 keys;                        // linear RGB and extinction per mm of each key
field1 places;                      // value of each key, ascending; two at one value make a step

const float NEVER = 3.0e38;
const float AGREED = 2.0e-7;     // of the colour of the ray
const float MOST_PARTS = 256.0;

// The value along the ray inside one cell: a cubic in s, -1/2 at the entry and 1/2 at the exit.
struct Cubic {
    vec4 c;
};

float value_of(Cubic f, float s) {
    return f.c.x + s * (f.c.y + s * (f.c.z + s * f.c.w));
}

// The cubic through the values at s = -3/8, -1/8, 1/8, 3/8.
Cubic cubic_through(vec4 v) {
    float even_far = 0.5 * (v.w + v.x);
    float even_near = 0.5 * (v.z + v.y);
    float odd_far = 0.5 * (v.w - v.x);
    float odd_near = 0.5 * (v.z - v.y);
    float c2 = (even_far - even_near) * 8.0;
    float c3 = (odd_far - 3.0 * odd_near) * (64.0 / 3.0);
    return Cubic(vec4(even_near - c2 / 64.0, 8.0 * odd_near - c3 / 64.0, c2, c3));
}

// Where the cubic turns inside the cell, in order; 1/2 for each place that is not there.
vec2 turns_of(Cubic f) {
    float a = 3.0 * f.c.w;
    float b = 2.0 * f.c.z;
    float c = f.c.y;
    float discriminant = b * b - 4.0 * a * c;
    vec2 found = vec2(0.5);
    if (discriminant > 0.0) {
        // Without cancellation: one root from the sum of equal signs, the other from the product of both.
        float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
        float one = a != 0.0 ? q / a : 0.5;
        float other = q != 0.0 ? c / q : 0.5;
        one = one > -0.5 && one < 0.5 ? one : 0.5;
        other = other > -0.5 && other < 0.5 ? other : 0.5;
        found = vec2(min(one, other), max(one, other));
    }
    return found;
}

// Where the cubic, which only rises or only falls from low to high, takes a value that it takes there.
float root_of(Cubic f, float value, float low, float high) {
    float a = low;
    float b = high;
    bool rising = value_of(f, high) > value_of(f, low);
    float s = 0.5 * (a + b);
    float error = 1.0;
    for (int i = 0; i < 40 && error != 0.0 && b > a; ++i) {
        error = value_of(f, s) - value;
        if (error > 0.0 == rising) {
            b = s;
        } else {
            a = s;
        }
        // Newton's step where it stays between, else the middle.
        float slope = f.c.y + s * (2.0 * f.c.z + s * 3.0 * f.c.w);
        float next = s - error / slope;
        next = next >= a && next <= b ? next : 0.5 * (a + b);
        if (next == s) {
            a = b;
        }
        s = next;
    }
    return s;
}

// The first place behind s where the cubic passes 0, or `stop`.
float next_zero(Cubic f, float s, float stop) {
    vec2 turns = turns_of(f);
    float low = s + 1.0e-6;
    float found = stop;
    for (int part = 0; part < 3; ++part) {
        float high = min(part == 0 ? turns.x : part == 1 ? turns.y : stop, stop);
        if (found == stop && low < high && value_of(f, low) * value_of(f, high) < 0.0) {
            found = root_of(f, 0.0, low, high);
        }
        low = max(low, high);
    }
    return found;
}

struct Sum {
    vec3 color;
    float hidden;
    float depth;    // mm from the ray's origin where depth_opacity is passed; NEVER before that
};

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

struct Piece {
    vec3 color;     // of what is seen of it, illuminated
    float depth;    // optical depth
};

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

Sum add(Sum sum, Piece piece) {
    float share = (1.0 - sum.hidden) * -expm1(-piece.depth);
    return Sum(sum.color + share * piece.color, sum.hidden + share, sum.depth);
}

// What one smooth piece adds.
Sum add_piece(Sum sum, Ray ray, Cubic f, Band band, float s0, float s1, float start, float length) {
    Sum result = sum;
    // Where the gradient nearly vanishes its direction swings, and light with it: part `index` of `parts` is halved until
    // halves and whole agree.
    float parts = 1.0;
    float index = 0.0;
    while (index < parts) {
        float a = mix(s0, s1, index / parts);
        float b = mix(s0, s1, (index + 1.0) / parts);
        Piece whole = integrate(ray, f, band, a, b, start, length);
        Sum next = add(result, whole);
        bool fine = true;
#if LIT
        float middle = 0.5 * (a + b);
        Sum halves = add(result, integrate(ray, f, band, a, middle, start, length));
        halves = add(halves, integrate(ray, f, band, middle, b, start, length));
        vec3 error = abs(next.color - halves.color);
        next = halves;
        fine = max(error.x, max(error.y, error.z)) < AGREED || parts >= MOST_PARTS;
#endif
        if (fine) {
            if (result.depth == NEVER && next.hidden >= depth_opacity && whole.depth > 0.0) {
                // As if the extinction went evenly from one end of the part to the other.
                float e0 = matter_in(band, value_of(f, a)).w;
                float e1 = matter_in(band, value_of(f, b)).w;
                float target = log((1.0 - result.hidden) / (1.0 - depth_opacity)) / whole.depth * 0.5 * (e0 + e1);
                float root = e0 + sqrt(max(e0 * e0 + 2.0 * (e1 - e0) * target, 0.0));
                float reach = root > 0.0 ? clamp(2.0 * target / root, 0.0, 1.0) : 0.0;
                next.depth = start + (mix(a, b, reach) + 0.5) * length;
            }
            result = next;
            index += 1.0;
            while (parts > 1.0 && mod(index, 2.0) == 0.0) {
                index *= 0.5;
                parts *= 0.5;
            }
        } else {
            parts *= 2.0;
            index *= 2.0;
        }
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

Result pixel(ivec2 at) {
    Ray ray = cast_ray(camera, picture_pixel(at));
    Result result = carried_result(at);
    if (result.color.w >= ENOUGH) {
        return result;
    }
    vec2 range = visible_range(ray, at);
    if (!(range.y > range.x) || size1(places) < 1) {
        return result;
    }
    vec3 per_unit = inverse_of(ray.direction);
    vec3 forward = mix(vec3(0.0), vec3(1.0), greaterThan(per_unit, vec3(0.0)));
    vec3 sense = 2.0 * forward - 1.0;
    vec3 last = whole_size() - 1.0;
    vec3 least = vec3(-1.0);
    vec3 most_cell = last;
#if CARRIED
    vec2 own = through_block(ray.origin, ray.direction);
    range = vec2(max(range.x, own.x), min(range.y, own.y));
    if (!(range.y > range.x)) {
        return result;
    }
    least = max(block_low, least);
    most_cell = min(block_high - 1.0, last);
#endif
    Sum sum = Sum(result.color.rgb, result.color.w, isinf(result.depth) ? NEVER : -NEVER);
    float t = range.x;
    vec3 cell = clamp(floor(ray.origin + ray.direction * t), least, most_cell);
    // Planes of the axes that the ray crosses next; outside the outermost voxels there are none.
    float steps = 0.0;
    float most = last.x + last.y + last.z + 8.0;
    while (t < range.y && sum.hidden < ENOUGH && steps < most) {
        vec3 exits = (cell + forward - ray.origin) * per_unit;
        float leave = min(exits.x, min(exits.y, exits.z));
        float stop = min(leave, range.y);
#if SKIP
        // That of any octant says it.
        vec3 b = floor((cell - bricks_corner()) / BRICK);
        b.z = clamp(b.z, 0.0, layers_of(bricks) - 1.0);
        bool seen = fetch3(bricks, ivec3(b)) < 0.0;
#else
        bool seen = true;
#endif
        if (stop > t && seen) {
            sum = add_cell(sum, ray, t, stop - t);
        }
        t = max(t, stop);
        // Exactly one axis a step, so that a ray through an edge crosses a cell of no length.
        if (exits.x <= leave) {
            cell.x += sense.x;
        } else if (exits.y <= leave) {
            cell.y += sense.y;
        } else {
            cell.z += sense.z;
        }
        steps += 1.0;
    }
    result.color = vec4(sum.color, sum.hidden);
    if (t < range.y && sum.hidden < ENOUGH && steps < most) {
        result.color = vec4(uintBitsToFloat(0x7fc00000u));  // the driver ended the loop
    }
    if (abs(sum.depth) < NEVER) {
        result.depth = (ray.start + sum.depth) * ray.cosine;
    }
    return result;
}
