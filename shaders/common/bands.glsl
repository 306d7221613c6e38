// The transfer function as bands of values, in each of which colour and extinction are linear in the value. No table is read at
// even places, so a jump is where it is, and a spike is as narrow as it is (nodegraph/data/bands.py).

#ifndef STEPS
#define STEPS 3         // to find a band among 2 to the power of this
#endif

field1 bands;           // for each band: its first and last matter, the integral up to it, and `ends` of a Place

// A point of a ray: its value, its band, what is there (at a step on its right side), and the integrals of (colour times
// extinction, extinction) over the values from the beginning of the band to the point, and from there to its end.
struct Place {
    float value;        // NaN where the volume has none
    float band;
    vec4 ends;          // first and last value of the band, and how far the matter jumps there
    vec4 matter;
    vec4 behind;
    vec4 ahead;
    vec4 before;        // up to the band
    vec4 after;         // up to the next
};

// Mean of (colour times extinction, extinction) where both are linear from one point to the other.
vec4 mean_of(vec4 a, vec4 b) {
    return vec4((a.rgb * (2.0 * a.w + b.w) + b.rgb * (a.w + 2.0 * b.w)) / 6.0, 0.5 * (a.w + b.w));
}

Place place_of(float value) {
    int band = 0;
    for (int i = 0; i < STEPS; ++i) {
        int next = band + (1 << (STEPS - 1 - i));
        band = fetch1(bands, 4 * next + 3).x <= value ? next : band;
    }
    vec4 first = fetch1(bands, 4 * band);
    vec4 last = fetch1(bands, 4 * band + 1);
    vec4 ends = fetch1(bands, 4 * band + 3);
    float width = ends.y - ends.x;
    vec4 matter = mix(first, last, width > 0.0 ? clamp((value - ends.x) / width, 0.0, 1.0) : 0.0);
    return Place(
        value, float(band), ends, matter, (value - ends.x) * mean_of(first, matter),
        (ends.y - value) * mean_of(matter, last), fetch1(bands, 4 * band + 2), fetch1(bands, 4 * band + 6));
}

// How far the matter jumps at a value that the ray may take between three points of it that do not reach it: beyond the
// highest and the lowest of them by half the bend is as far as a parabola gets, or a line with one kink.
float missed_between(Place front, Place middle, Place back) {
    float bend = 4.0 * abs(middle.value - 0.5 * (front.value + back.value));
    float high = max(middle.value, max(front.value, back.value)) + bend;
    float low = min(middle.value, min(front.value, back.value)) - bend;
    vec4 top = middle.band > front.band ? middle.ends : front.ends;
    top = back.band > max(front.band, middle.band) ? back.ends : top;
    vec4 bottom = middle.band < front.band ? middle.ends : front.ends;
    bottom = back.band < min(front.band, middle.band) ? back.ends : bottom;
    return max(high >= top.y ? top.w : 0.0, low < bottom.x ? bottom.z : 0.0);
}

// Mean colour and extinction where the value goes evenly from one place to the other; nothing where one is missing.
vec4 between(Place front, Place back) {
#if !FINITE
    if (isnan(front.value) || isnan(back.value)) {
        return vec4(0.0);
    }
#endif
    // Sums of what is never below 0: no digits are lost where a jump lies between two values that are nearly the same.
    vec4 rising = front.ahead + (back.before - front.after) + back.behind;
    vec4 falling = back.ahead + (front.before - back.after) + front.behind;
    vec4 all = front.band < back.band ? rising / (back.value - front.value) : falling / (front.value - back.value);
    vec4 mean = front.band == back.band ? mean_of(front.matter, back.matter) : all;
    return vec4(mean.w > 0.0 ? mean.rgb / mean.w : vec3(0.0), mean.w);
}
