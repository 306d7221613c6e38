// Depth darkening, in two passes: weighted row sums of depth, then column sums and the darkening itself.

#ifndef PASS
#define PASS 0              // 0 sums along rows, 1 sums along columns and darkening
#endif

uniform float sigma;        // pixels
uniform int radius;         // pixels, where the Gaussian is cut off
uniform int stride;         // of the pixels under it every one counts, or every so many-th

// The first offset that counts where ``room`` pixels lie before this one.
int first(int room) {
    return -(min(radius, room) / stride) * stride;
}

float weight(int offset) {
    float x = float(offset) / sigma;
    return exp(-0.5 * x * x);
}

#if PASS == 0
field2 depth;
uniform float reference;    // mm, subtracted so that sums keep their digits

// (sum of weight * depth, sum of weight) along the row, over the pixels that show something.
vec2 pixel(ivec2 at) {
    int width = size2(depth).x;
    vec2 sum = vec2(0.0);
    for (int d = first(at.x); d <= min(radius, width - 1 - at.x); d += stride) {
        float z = fetch2(depth, at + ivec2(d, 0)).x;
        if (!isinf(z) && !isnan(z)) {
            sum += weight(d) * vec2(z - reference, 1.0);
        }
    }
    return sum;
}
#else
field2 depth;
field2 rows;
field2 image;
uniform float reference;
uniform float range;        // mm of depth difference that darken by `strength`
uniform float strength;

vec4 pixel(ivec2 at) {
    int height = size2(depth).y;
    vec4 color = fetch2(image, at);
    float z = fetch2(depth, at).x;
    if (isinf(z) || isnan(z)) {
        return color;
    }
    vec2 sum = vec2(0.0);
    for (int d = first(at.y); d <= min(radius, height - 1 - at.y); d += stride) {
        sum += weight(d) * fetch2(rows, at + ivec2(0, d)).xy;
    }
    float difference = sum.x / sum.y - (z - reference);
    float dark = strength * clamp(difference / range, -1.0, 0.0);
    return vec4(color.rgb * (1.0 + dark), color.a);
}
#endif
