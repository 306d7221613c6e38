// Put a picture over a background of one colour, or of two that blend.

#ifndef PATTERN
#define PATTERN 0           // 0 solid, 1 vertical, 2 radial
#endif

field2 image;
uniform vec3 color;         // linear; the top, or the middle
uniform vec3 second_color;

vec4 pixel(ivec2 at) {
    vec4 front = fetch2(image, at);
    vec2 size = vec2(size2(image));
    vec2 p = (vec2(at) + 0.5) / size;
#if PATTERN == 0
    vec3 back = color;
#elif PATTERN == 1
    vec3 back = mix(color, second_color, p.y);
#else
    vec2 q = (p - 0.5) * size / min(size.x, size.y);
    vec3 back = mix(color, second_color, smoothstep(0.0, 0.8, length(q)));
#endif
    return vec4(front.rgb + (1.0 - front.a) * back, 1.0);
}
