// Leaping over what cannot be seen, by whole segments of a ray: no sample that is made moves.
//
// The volume is cut into bricks of 4^3 cells (see nodegraph/data/bricks.py). `bricks` holds, for one that cannot be
// seen, the Chebyshev distance in bricks to the nearest that can be: all bricks nearer than that are left out at once.
// For one that can be seen it holds nothing above zero.
// Source: Schlosser 2009, C06 (visibility by value range).

#ifndef SKIP
#define SKIP 0          // 1: what cannot be seen is left out
#endif

#if SKIP
#ifdef SEARCHES_ALL
field3v bricks;                 // least and greatest value of each
#else
field3 bricks;                  // how far it is to the nearest that can be seen
#endif
#endif

const float BRICK = 4.0;        // cells along an edge
const float SLACK = 1.0e-3;     // bricks by which a cube is taken for smaller, for the rounding of positions

// A ray in units of bricks and segments: segment k begins at origin + k * along.
struct Leaper {
    vec3 origin;
    vec3 along;
    vec3 per_brick;     // segments for each brick of each axis, with its sign
    vec3 forward;       // 1 where the ray goes up the axis, else 0
};

// 1 / v that can be multiplied by: no infinity where the ray does not move along an axis.
vec3 inverse_of(vec3 v) {
    vec3 least = vec3(1.0e-30);
    return 1.0 / mix(v, least, lessThan(abs(v), least));
}

Leaper leaper_of(vec3 origin, vec3 direction, float step_length) {
    Leaper leaper;
    leaper.origin = origin / BRICK;
    leaper.along = direction * (step_length / BRICK);
    leaper.per_brick = inverse_of(leaper.along);
    leaper.forward = mix(vec3(0.0), vec3(1.0), greaterThan(leaper.per_brick, vec3(0.0)));
    return leaper;
}

// How many segments from the beginning of segment k on lie, as a whole, in the cube of bricks nearer than `reach` to its own.
// Beyond the outermost bricks, where the edge of the volume repeats, they go on.
float segments_within(Leaper leaper, float k, vec3 brick, float reach) {
    vec3 side = brick + 0.5 + (2.0 * leaper.forward - 1.0) * (reach - 0.5 - SLACK);
    vec3 exits = (side - leaper.origin - k * leaper.along) * leaper.per_brick;
    return floor(min(exits.x, min(exits.y, exits.z)));
}

// The first segment from k on, and before `end`, that may be seen; `end` if there is none. All must lie inside the volume.
float leap(field3 bricks, Leaper leaper, float k, float end) {
    float here = k;
    bool searching = here < end;
    while (searching) {
        vec3 brick = floor(leaper.origin + here * leaper.along);
        float away = fetch3(bricks, ivec3(brick));
        // Segments end where bricks do not: the one in which the cube ends is looked at.
        float next = here + segments_within(leaper, here, brick, away);
        searching = away > 0.0 && next > here;
        here = searching ? min(next, end) : here;
        searching = searching && here < end;
    }
    return here;
}
