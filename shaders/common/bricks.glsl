// Leaping over what cannot be seen, by whole segments of a ray: no sample that is made moves.
//
// The volume is cut into bricks of 4^3 cells (see nodegraph/data/bricks.py). `bricks` holds for each of them, and for each
// of the eight octants into which rays go, how far, in bricks, it is from its middle to the far sides of the cube that
// begins with it and in which nothing can be seen: all of that is left out at once. For a brick that can be seen it holds
// -1/2.
// Source: Schlosser 2009, C06 (visibility by value range).

#ifndef SKIP
#define SKIP 0          // 1: bricks in which nothing is looked for are left out
#endif

#if SKIP
#ifdef SEARCHES_ALL
field3v bricks;                 // least and greatest value of each
#else
field3 bricks;                  // how far a ray may leap from each, octant by octant along z
#endif
#endif

const float BRICK = 4.0;        // cells along an edge
const float ONE_BRICK = 0.5;    // from the middle of a brick to its sides
const float ROUNDING = 0.001;   // of positions, in bricks

// A ray in units of bricks and segments. Of segment k it looks at what lies from origin + k * along on, `span` segments
// long: 1 where an integrator looks at both ends of a segment, 0 where it looks at one point of it.
struct Leaper {
    vec3 origin;
    vec3 along;
    vec3 per_brick;     // segments for each brick of each axis, with its sign
    vec3 cross_brick;   // without it
    float whole;        // 1 - span
    float first_layer;  // of the octant into which the ray goes
    float last_layer;
};

// 1 / v that can be multiplied by: no infinity where the ray does not move along an axis.
vec3 inverse_of(vec3 v) {
    vec3 least = vec3(1.0e-30);
    return 1.0 / mix(v, least, lessThan(abs(v), least));
}

// `looked`: where in a segment an integrator looks first, and where last; 0 is its beginning, 1 its end. `layers`: of
// bricks along z.
Leaper leaper_of(vec3 origin, vec3 direction, float step_length, vec2 looked, float layers) {
    Leaper leaper;
    leaper.along = direction * (step_length / BRICK);
    leaper.origin = origin / BRICK + looked.x * leaper.along;
    leaper.per_brick = inverse_of(leaper.along);
    leaper.cross_brick = abs(leaper.per_brick);
    leaper.whole = 1.0 - (looked.y - looked.x);
    leaper.first_layer = layers * dot(step(0.0, leaper.per_brick), vec3(1.0, 2.0, 4.0));
    leaper.last_layer = leaper.first_layer + layers - 1.0;
    return leaper;
}

// In how many segments, from the one that is looked at from `place` on, all that is looked at lies before the sides of a
// cube that are `reach` ahead of the middle of `brick`; not above 0 where there is none. Beyond the outermost bricks,
// where the edge of the volume repeats, bricks go on.
float segments_within(Leaper leaper, vec3 place, vec3 brick, float reach) {
    // Little is left to be done once `reach` is read: this is what a ray waits for most.
    vec3 nearly = (brick + 0.5 - place) * leaper.per_brick - ROUNDING * leaper.cross_brick;
    vec3 exits = nearly + reach * leaper.cross_brick;
    return floor(min(exits.x, min(exits.y, exits.z)) + leaper.whole);
}

// Layers of bricks along z, of which each octant has as many.
float layers_of(field3 bricks) {
    return float(size3(bricks).z / 8);
}

// The first segment from k on, and before `end`, that may be seen; `end` if there is none.
float leap(field3 bricks, Leaper leaper, float k, float end) {
    float here = k;
    bool searching = here < end;
    while (searching) {
        vec3 place = leaper.origin + here * leaper.along;
        vec3 brick = floor(place);
        float layer = clamp(brick.z + leaper.first_layer, leaper.first_layer, leaper.last_layer);
        float reach = fetch3(bricks, ivec3(vec3(brick.xy, layer)));
        float count = segments_within(leaper, place, brick, reach);
        here = min(here + max(count, 0.0), end);
        searching = count > 0.0 && here < end;
    }
    return here;
}
