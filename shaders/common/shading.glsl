// Local illumination in eye space: x right, y up, z backwards, origin at the eye, mm.

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

// Phong 1975 (Rezk-Salama 2001, I01; Lindemann 2014, L24): colour of a surface point seen along `view` (a unit
// vector from the eye to the point). The normal may point either way and have any length: the side that faces the
// viewer is lit. Where the gradient vanishes there is no surface, so nothing is reflected towards anybody in
// particular: ambient and diffuse light only.
vec3 shade_phong(vec3 color, vec3 gradient, vec3 point, vec3 view, Light light, Material material) {
    // Without branches, of which devices that run many pixels in step would take both sides anyway.
    vec3 to_light = light.directional ? light.position : normalize(light.position - point);
    vec3 size = abs(gradient);
    float largest = max(size.x, max(size.y, size.z));
    vec3 scaled = gradient / largest;       // its square neither overflows nor vanishes
    vec3 normal = scaled * inversesqrt(dot(scaled, scaled));
    normal = dot(normal, view) > 0.0 ? -normal : normal;
    float cosine = max(dot(normal, to_light), 0.0);
    vec3 mirrored = 2.0 * cosine * normal - to_light;
    float gloss = cosine > 0.0 ? pow(max(-dot(mirrored, view), 0.0), material.shininess) : 0.0;
    vec3 lit = color * material.ambient + light.color * (material.diffuse * cosine * color + material.specular * gloss);
    vec3 flat_lit = color * (material.ambient + material.diffuse * light.color);
    bool surface = largest > 0.0 && !isinf(largest) && !any(isnan(normal));
    return surface ? lit : flat_lit;
}
