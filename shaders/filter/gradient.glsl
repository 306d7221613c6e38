// Gradient of a scalar volume in world space: (x, y, z) per mm, and its length.

#ifndef METHOD
#define METHOD 0            // 0 central, 1 forward, 2 Sobel 3x3x3
#endif

field3 volume;
uniform mat3 to_world;      // takes gradients per index unit to gradients per mm in world space

float at(ivec3 i) {
    return fetch3(volume, clamp(i, ivec3(0), size3(volume) - 1));
}

// Difference over the samples a and b, divided by their distance; 0 where the volume is one voxel thick.
float slope(float high, float low, int distance) {
    return distance > 0 ? (high - low) / float(distance) : 0.0;
}

// Sobel's weights in the plane across an axis, for one of its two layers; they sum to 26.
float layer(ivec3 centre, ivec3 u, ivec3 v) {
    float corners = at(centre - u - v) + at(centre - u + v) + at(centre + u - v) + at(centre + u + v);
    float edges = at(centre - u) + at(centre + u) + at(centre - v) + at(centre + v);
    return 6.0 * at(centre) + 3.0 * edges + 2.0 * corners;
}

vec4 voxel(ivec3 i) {
    ivec3 x = ivec3(1, 0, 0);
    ivec3 y = ivec3(0, 1, 0);
    ivec3 z = ivec3(0, 0, 1);
    ivec3 last = size3(volume) - 1;
    ivec3 high = min(i + 1, last);
#if METHOD == 1
    ivec3 low = min(i, max(last - 1, 0));
#else
    ivec3 low = max(i - 1, 0);
#endif
    ivec3 span = high - low;
    vec3 g;
#if METHOD == 2
    g.x = slope(layer(ivec3(high.x, i.y, i.z), y, z), layer(ivec3(low.x, i.y, i.z), y, z), span.x);
    g.y = slope(layer(ivec3(i.x, high.y, i.z), x, z), layer(ivec3(i.x, low.y, i.z), x, z), span.y);
    g.z = slope(layer(ivec3(i.x, i.y, high.z), x, y), layer(ivec3(i.x, i.y, low.z), x, y), span.z);
    g = g / 26.0;
#else
    g.x = slope(at(ivec3(high.x, i.y, i.z)), at(ivec3(low.x, i.y, i.z)), span.x);
    g.y = slope(at(ivec3(i.x, high.y, i.z)), at(ivec3(i.x, low.y, i.z)), span.y);
    g.z = slope(at(ivec3(i.x, i.y, high.z)), at(ivec3(i.x, i.y, low.z)), span.z);
#endif
    vec3 world = transform(to_world, g);
    if (any(isnan(world)) || any(isinf(world))) {
        return vec4(uintBitsToFloat(0x7fc00000u));  // beside a voxel that is not finite
    }
    // As long as `world`, without squares: those of 1e20 and of 1e-23 leave single precision.
    return vec4(world, dot(world, normalize(world)));
}
