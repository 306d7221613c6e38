// Transfer function as a table of (linear red, green, blue, extinction per mm) over the values low..high.

#ifndef FINITE
#define FINITE 0        // 1: the volume holds integers, so no value has to be tested for being finite
#endif

// True where a value is made of a voxel that is not finite: there is nothing to be seen, whatever the transfer
// function says of great values. What is empty may then be told from the least and the greatest finite value.
bool is_missing(float value) {
#if FINITE
    return false;
#else
    return isnan(value) || isinf(value);
#endif
}

// `lookup` is (scale, offset) from a value to the table's index space. What is missing is transparent black.
vec4 classify(field1 table, vec2 lookup, float value) {
#if !FINITE
    if (is_missing(value)) {
        return vec4(0.0);
    }
#endif
    return sample1(table, value * lookup.x + lookup.y);
}

// Transfer function of two variables as a table of (colour times extinction, extinction per mm): columns by value, rows
// by gradient magnitude. `place` is (column, row). Interpolated colours would fade to black where nothing begins.
vec4 classify_2d(field2 table, vec2 place) {
    vec4 matter = sample2(table, place);
    return matter.w > 0.0 ? vec4(matter.rgb / matter.w, matter.w) : vec4(0.0);
}
