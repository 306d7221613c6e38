// Local illumination in eye space: x right, y up, z backwards, origin at the eye, mm.

#ifndef GLOSS
#define GLOSS 1         // 1: some light is reflected as by a mirror
#endif

struct Light {
    vec3 position;      // unit vector towards the lamp, or its position
    vec3 color;         // linear RGB times intensity
    bool directional;
};

struct Material {
    float ambient;
    float diffuse;
    float specular;
    float shininess;
};

const float AT_THE_LAMP = 1.0e-30;  // mm^2: so near to it light has no direction

// Phong 1975 (Rezk-Salama 2001, I01; Lindemann 2014, L24): colour of a surface point seen along `view` (a unit
// vector from the eye to the point). The normal may point either way and have any length: the side that faces the
// viewer is lit. Where the gradient vanishes there is no surface, so nothing is reflected towards anybody in
// particular: ambient and diffuse light only.
vec3 shade_phong(vec3 color, vec3 gradient, vec3 point, vec3 view, Light light, Material material) {
    // Without branches, of which devices that run many pixels in step would take both sides anyway.
    vec3 size = abs(gradient);
    vec3 scaled = gradient * (1.0 / max(size.x, max(size.y, size.z)));  // its square neither overflows nor vanishes
    float square = dot(scaled, scaled);
    // From 1 to 3, unless there is nothing or something that is not finite.
    bool surface = square > 0.5 && square < 4.0;
    vec3 to_light = light.directional ? light.position : light.position - point;
    float away = max(dot(to_light, to_light), AT_THE_LAMP);
    float facing = dot(scaled, view) > 0.0 ? -1.0 : 1.0;
    float cosine = max(facing * dot(scaled, to_light), 0.0) * inversesqrt(square * away);
    vec3 lit = color * (material.ambient + material.diffuse * light.color * (surface ? cosine : 1.0));
#if GLOSS
    // Of the mirrored light with the way to the eye.
    float mirrored = 2.0 * cosine * abs(dot(scaled, view)) * inversesqrt(square);
    float narrow = max(mirrored + dot(to_light, view) * inversesqrt(away), 0.0);
    lit += light.color * (surface && cosine > 0.0 ? material.specular * pow(narrow, material.shininess) : 0.0);
#endif
    return lit;
}
