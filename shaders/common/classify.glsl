// Transfer function as a table of (linear red, green, blue, extinction per mm) over the values low..high.

#ifndef FINITE
#define FINITE 0        // 1: the volume holds integers, so no value has to be tested for being a number
#endif

// `lookup` is (scale, offset) from a value to the table's index space. NaN is transparent black.
vec4 classify(field1 table, vec2 lookup, float value) {
#if !FINITE
    if (isnan(value)) {
        return vec4(0.0);
    }
#endif
    return sample1(table, value * lookup.x + lookup.y);
}
