// Leaping over what cannot be seen, by whole segments of a ray: no sample that is made moves.
//
// The volume is cut into bricks of 4^3 cells (see nodegraph/data/bricks.py). `bricks` holds how far, in bricks, it is from
// the middle of one to the sides of the cube about it in which nothing can be seen: all of that is left out at once. For
// a brick that can be seen it holds something far below zero.
// Source: Schlosser 2009, C06 (visibility by value range).

#ifndef SKIP
#define SKIP 0          // 1: what cannot be seen is left out
#endif

#if SKIP
#ifdef SEARCHES_ALL
field3v bricks;                 // least and greatest value of each
#else
field3 bricks;                  // how far a ray may leap from each
#endif
#endif

const float BRICK = 4.0;        // cells along an edge
const float ONE_BRICK = 0.499;  // reach of a brick by itself, less the rounding of positions

// A ray in units of bricks and segments. Of segment k it looks at what lies from origin + k * along on, `span` segments
// long: 1 where an integrator looks at both ends of a segment, 0 where it looks at one point of it.
struct Leaper {
    vec3 origin;
    vec3 along;
    vec3 per_brick;     // segments for each brick of each axis, with its sign
    vec3 cross_brick;   // without it
    float whole;        // 1 - span
};

// 1 / v that can be multiplied by: no infinity where the ray does not move along an axis.
vec3 inverse_of(vec3 v) {
    vec3 least = vec3(1.0e-30);
    return 1.0 / mix(v, least, lessThan(abs(v), least));
}

// `looked`: where in a segment an integrator looks first, and where last; 0 is its beginning, 1 its end.
Leaper leaper_of(vec3 origin, vec3 direction, float step_length, vec2 looked) {
    Leaper leaper;
    leaper.along = direction * (step_length / BRICK);
    leaper.origin = origin / BRICK + looked.x * leaper.along;
    leaper.per_brick = inverse_of(leaper.along);
    leaper.cross_brick = abs(leaper.per_brick);
    leaper.whole = 1.0 - (looked.y - looked.x);
    return leaper;
}

// In how many segments, from the one that is looked at from `place` on, all that is looked at lies in the cube that
// reaches so far from the middle of `brick`; below 0 where there is none. Beyond the outermost bricks, where the edge of
// the volume repeats, bricks go on.
float segments_within(Leaper leaper, vec3 place, vec3 brick, float reach) {
    // Little is left to be done once `reach` is read: this is what a ray waits for most.
    vec3 exits = (brick + 0.5 - place) * leaper.per_brick + reach * leaper.cross_brick;
    return floor(min(exits.x, min(exits.y, exits.z)) + leaper.whole);
}

// The first segment from k on, and before `end`, that may be seen; `end` if there is none.
float leap(field3 bricks, Leaper leaper, float k, float end) {
    float here = k;
    bool searching = here < end;
    while (searching) {
        vec3 place = leaper.origin + here * leaper.along;
        vec3 brick = floor(place);
        float count = segments_within(leaper, place, brick, fetch3(bricks, ivec3(brick)));
        here = min(here + max(count, 0.0), end);
        searching = count > 0.0 && here < end;
    }
    return here;
}
