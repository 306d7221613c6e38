// Leaping over what cannot be seen, by whole segments of a ray: no sample that is made moves.
//
// The volume is cut into bricks of 8^3 cells (see nodegraph/data/bricks.py). `bricks` holds, for one that cannot be
// seen, the Chebyshev distance in bricks to the nearest that can be; for one that can be, minus the distance to the
// nearest that cannot. So all bricks nearer than that are of the same kind, and a ray may go through them unasked.
// Source: Schlosser 2009, C06 (visibility by value range).

const float BRICK = 8.0;        // cells along an edge
const float BEYOND = 1.0e9;     // voxels: the outermost bricks reach as far as the edge repeats
const float SLACK = 1.0e-3;     // voxels by which a brick is taken for smaller, for the rounding of positions

struct Run {
    float first;
    float stop;         // the run is the segments from first to stop - 1
};

// 1 / direction that can be multiplied by: no infinity where the ray does not move along an axis.
vec3 inverse_of(vec3 direction) {
    vec3 least = vec3(1.0e-30);
    return 1.0 / mix(direction, least, lessThan(abs(direction), least));
}

// Where the ray leaves the cube of bricks less than `reach` bricks from brick b, mm.
float leave_cube(vec3 origin, vec3 per_unit, vec3 b, float reach, vec3 last) {
    vec3 low = (b - (reach - 1.0)) * BRICK + SLACK;
    vec3 high = (b + reach) * BRICK - SLACK;
    low = mix(low, vec3(-BEYOND), lessThanEqual(b - (reach - 1.0), vec3(0.0)));
    high = mix(high, vec3(BEYOND), greaterThan(b + reach, last));
    vec3 exits = (mix(low, high, greaterThan(per_unit, vec3(0.0))) - origin) * per_unit;
    return min(exits.x, min(exits.y, exits.z));
}

// The first run of segments from `next` on, and before `end`, that may be seen; an empty one at `end` if there is none.
// All of them must lie inside the volume.
Run next_run(field3 bricks, vec3 origin, vec3 direction, vec3 per_unit, float step_length, float next, float end) {
    vec3 last = vec3(size3(bricks)) - 1.0;
    Run run = Run(next, end);
    bool searching = true;
    while (searching) {
        vec3 p = origin + direction * (run.first * step_length);
        vec3 b = clamp(floor(p / BRICK), vec3(0.0), last);
        float distance_to = fetch3(bricks, ivec3(b));
        float leave = leave_cube(origin, per_unit, b, abs(distance_to), last);
        float stop = min(floor(leave / step_length), end);
        if (!(stop > run.first)) {
            // The brick ends within this segment.
            run.stop = run.first + 1.0;
            searching = false;
        } else if (distance_to > 0.0) {
            run.first = stop;
            run.stop = stop;
            searching = stop < end;
        } else {
            run.stop = stop;
            searching = false;
        }
    }
    return run;
}
