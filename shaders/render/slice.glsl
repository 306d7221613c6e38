// One plane of a volume, coloured by a transfer function or by a grey window.

#include "common/classify.glsl"

#ifndef NEAREST
#define NEAREST 0       // 0 trilinear interpolation, 1 the nearest voxel
#endif
#ifndef WINDOW
#define WINDOW 1        // 0 coloured by a transfer function, 1 by a grey window
#endif

field3 volume;
uniform vec3 corner;        // index space: middle of the picture's top left pixel
uniform vec3 right;         // index space: one pixel to the right, one pixel down
uniform vec3 down;
#if WINDOW
uniform vec2 window;        // the value shown black, and grey 0..1 per value
#else
field1 table;
uniform vec2 lookup;
uniform float thickness;    // mm of material that the slice stands for
#endif

vec4 pixel(ivec2 at) {
    vec3 p = corner + right * float(at.x) + down * float(at.y);
    vec3 last = vec3(size3(volume)) - 0.5;
    if (any(lessThan(p, vec3(-0.5))) || any(greaterThan(p, last))) {
        return vec4(0.0);
    }
#if NEAREST
    // The middle of an even number of slices lies between two voxels: the upper one, whatever the last digit says.
    float value = fetch3(volume, ivec3(floor(p + 0.50001)));
#else
    float value = sample3(volume, p);
#endif
#if !FINITE
    if (is_missing(value)) {
        return vec4(0.0);
    }
#endif
#if WINDOW
    return vec4(vec3(clamp((value - window.x) * window.y, 0.0, 1.0)), 1.0);
#else
    vec4 matter = classify(table, lookup, value);
    return vec4(matter.rgb, 1.0) * -expm1(-matter.w * thickness);
#endif
}
