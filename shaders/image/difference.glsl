// Absolute difference of two pictures, amplified, opaque.

field2 image;
field2 reference;
uniform float gain;

vec4 pixel(ivec2 at) {
    vec4 d = abs(fetch2(image, at) - fetch2(reference, at)) * gain;
    return vec4(max(d.rgb, vec3(d.a)), 1.0);
}
