// Emission and absorption along the rays through a scalar volume, classified by value and gradient magnitude, and cut where
// anything has a kink. Inside a cell the value and the components of the gradient are cubics; the magnitude is no
// polynomial, and edges of areas are curves. So a cell is halved by what is known of a part, from bounds on its cubics: until
// no edge can lie in it, or what an edge can do there is nothing (docs/decisions/0012-two-dimensional-transfer-functions.md).
#define BY_GRADIENT 1
#include "common/areas.glsl"
#include "common/bricks.glsl"
#include "common/cubic.glsl"
#include "common/gauss.glsl"
#include "common/halves.glsl"
#include "common/pieces.glsl"

const float MOST_TURNS = 4096.0;    // in one cell, before a part is not halved as often any more: where the ray runs along an edge
const float NARROWEST = 4096.0;     // parts of a cell from then on

// A cubic, and where it turns.
struct Bounded {
    Cubic f;
    vec2 turns;
};

// What the ray meets inside one cell.
struct Cell {
    Bounded value;
    Bounded x;          // gradient in eye space
    Bounded y;
    Bounded z;
    Bounded facing;     // 0 where a surface turns its other side to the viewer, and light jumps
    Bounded shadow;     // 0 where it turns from the lamp, and light has a kink
    float start;        // mm
    float length;
};

Bounded bounded(vec4 v) {
    Cubic f = cubic_through(v);
    return Bounded(f, turns_of(f));
}

// Least and greatest value of a cubic between two places.
vec2 range_of(Bounded c, float a, float b) {
    float front = value_of(c.f, a);
    float back = value_of(c.f, b);
    float one = value_of(c.f, clamp(c.turns.x, a, b));
    float other = value_of(c.f, clamp(c.turns.y, a, b));
    return vec2(min(min(front, back), min(one, other)), max(max(front, back), max(one, other)));
}

vec2 spot_in(Cell cell, float s) {
    return vec2(
        value_of(cell.value.f, s),
        magnitude_of(vec3(value_of(cell.x.f, s), value_of(cell.y.f, s), value_of(cell.z.f, s))));
}

// Bounds of a part of a cell: values in low.x .. high.x, magnitudes in low.y .. high.y.
struct Box {
    vec2 low;
    vec2 high;
};

Box box_of(Cell cell, float a, float b) {
    vec2 values = range_of(cell.value, a, b);
    vec2 x = range_of(cell.x, a, b);
    vec2 y = range_of(cell.y, a, b);
    vec2 z = range_of(cell.z, a, b);
    vec3 low = vec3(x.x, y.x, z.x);
    vec3 high = vec3(x.y, y.y, z.y);
    return Box(
        vec2(values.x, magnitude_of(clamp(vec3(0.0), low, high))),
        vec2(values.y, magnitude_of(max(abs(low), abs(high)))));
}

// How much is known of a part: the most extinction that can be in it, by how much extinction may differ there, whether
// nothing has a kink, and the first area that can be met and the one behind the last.
struct Part {
    float most;
    float differs;
    bool even;
    int first;
    int behind;
};

// Of a part that meets no area but those of `around`.
Part part_of(Cell cell, float a, float b, Part around) {
    Box box = box_of(cell, a, b);
    // The magnitude has a kink where the gradient vanishes.
    Part part = Part(0.0, 0.0, box.low.y > 0.0 || box.high.y == 0.0, around.behind, around.first);
    for (int i = around.first; i < around.behind; ++i) {
        Area area = area_of(i);
        Known known = known_of(area, box.low, box.high);
        if (known.most > 0.0) {
            part.most += known.most * area.matter.w;
            part.differs += (known.most - known.least) * area.matter.w;
            part.even = part.even && known.even;
            part.first = min(part.first, i);
            part.behind = i + 1;
        }
    }
    return part;
}

// A part of a cell by Gauss and Legendre as a collocation method.
Piece integrate(Ray ray, Cell cell, float a, float b, Part part) {
    vec2 spots[ORDER];
    vec4 matter[ORDER];
    float extinction[ORDER];
    for (int i = 0; i < ORDER; ++i) {
        spots[i] = spot_in(cell, mix(a, b, nodes[i]));
        matter[i] = vec4(0.0);
    }
    for (int k = part.first; k < part.behind; ++k) {
        Area area = area_of(k);
        for (int i = 0; i < ORDER; ++i) {
            matter[i] += matter_in(area, spots[i]);
        }
    }
    for (int i = 0; i < ORDER; ++i) {
        matter[i] = matter_of(matter[i]);
        extinction[i] = matter[i].w;
    }
    Seen seen = see(extinction, (b - a) * cell.length);
    vec3 color = vec3(0.0);
    for (int i = 0; i < ORDER; ++i) {
        float t = cell.start + (mix(a, b, nodes[i]) + 0.5) * cell.length;
        color += seen.shares[i] * shade(matter[i].rgb, ray, t);
    }
    return Piece(color, seen.depth);
}

float extinction_in(Cell cell, float s, Part part) {
    vec2 spot = spot_in(cell, s);
    float extinction = 0.0;
    for (int i = part.first; i < part.behind; ++i) {
        extinction += matter_in(area_of(i), spot).w;
    }
    return extinction;
}

bool turns_in(Cell cell, float a, float b) {
#if LIT
    vec2 facing = range_of(cell.facing, a, b);
    vec2 shadow = range_of(cell.shadow, a, b);
    return (facing.x < 0.0 && facing.y > 0.0) || (shadow.x < 0.0 && shadow.y > 0.0);
#else
    return false;
#endif
}

// What one cell adds.
Sum add_cell(Sum sum, Ray ray, float start, float length) {
    Sum result = sum;
    vec4 values = vec4(0.0);
    vec4 x = vec4(0.0);
    vec4 y = vec4(0.0);
    vec4 z = vec4(0.0);
    vec4 lamps = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        float t = start + (0.125 + 0.25 * float(i)) * length;
        vec3 slope = slope_at(ray, t);
        values[i] = value_at(ray, t, true);
        x[i] = slope.x;
        y[i] = slope.y;
        z[i] = slope.z;
#if LIT
        lamps[i] = dot(slope, light.position - (light.directional ? vec3(0.0) : ray.eye_origin + ray.eye_direction * t));
#endif
        if (is_missing(values[i]) || is_lost(magnitude_of(slope))) {
            return result;
        }
    }
    vec4 away = x * ray.eye_direction.x + y * ray.eye_direction.y + z * ray.eye_direction.z;
    Cell cell = Cell(
        bounded(values), bounded(x), bounded(y), bounded(z), bounded(away), bounded(lamps), start, length);
    Part around = part_of(cell, -0.5, 0.5, Part(0.0, 0.0, true, 0, size1(areas) / 4));
    // Up to there single and double precision tell places in a cell apart.
    float finest = 1.0 + 1.0e-12 > 1.0 ? 17592186044416.0 : 2097152.0;
    // What is looked at of the cell; it lies in one of `smooth_parts` that is smooth.
    Portion portion = Portion(0.0, 1.0);
    float smooth_parts = 1.0;
    float turns = 0.0;
    while (portion.index < portion.parts && result.hidden < ENOUGH && around.most > 0.0) {
        float a = portion.index / portion.parts - 0.5;
        float b = (portion.index + 1.0) / portion.parts - 0.5;
        Part part = part_of(cell, a, b, around);
        float most = (1.0 - result.hidden) * length / portion.parts;    // mm, less what is hidden
        bool known = (part.even || part.differs * most < AGREED) &&
            (!turns_in(cell, a, b) || part.most * most < AGREED);
        bool settled = known || portion.parts >= (turns < MOST_TURNS ? finest : NARROWEST);
        smooth_parts = settled ? min(smooth_parts, portion.parts) : 2.0 * portion.parts;
        turns += 1.0;
        if (settled && part.most > 0.0) {
            Piece whole = integrate(ray, cell, a, b, part);
            float middle = 0.5 * (a + b);
            Sum coarse = add(result, whole);
            Sum halves = add(result, integrate(ray, cell, a, middle, part));
            halves = add(halves, integrate(ray, cell, middle, b, part));
            vec3 error = abs(coarse.color - halves.color);
            float worst = max(abs(coarse.hidden - halves.hidden), max(error.x, max(error.y, error.z)));
            bool passed = result.depth == NEVER && halves.hidden >= depth_opacity && whole.depth > 0.0;
            settled = (worst < AGREED && !passed) || portion.parts >= MOST_PARTS * smooth_parts || portion.parts >= finest;
            if (settled) {
                if (passed) {
                    float front = extinction_in(cell, a, part);
                    float back = extinction_in(cell, b, part);
                    halves.depth = start + (mix(a, b, reached(result, whole.depth, front, back)) + 0.5) * length;
                }
                result = halves;
            }
        }
        portion = settled ? after(portion) : halved(portion);
    }
    if (portion.index < portion.parts && result.hidden < ENOUGH && around.most > 0.0) {
        result.hidden = uintBitsToFloat(0x7fc00000u);   // the driver ended the loop
    }
    return result;
}

#include "common/cells.glsl"
