// The light on a point of a ray through a scalar volume.
#include "common/classify.glsl"
#include "common/rays.glsl"
#include "common/gradient.glsl"
#include "common/shading.glsl"

#ifndef LIT
#define LIT 0           // Phong illumination
#endif
#ifndef GRADIENT
#define GRADIENT 0      // 1: a volume of gradients is bound, 2: with values beside them; 0: differences on the fly
#endif
#if GRADIENT
field3v gradient;
#endif
#if LIT
uniform Light light;
uniform Material material;
#endif
// Whether slopes are asked for: for light, or for what is seen.
#if LIT
#define SLOPES 1
#elif defined(BY_GRADIENT)
#define SLOPES BY_GRADIENT
#else
#define SLOPES 0
#endif
#if SLOPES
#if GRADIENT == 2
uniform float vanishing;            // per index unit: no component is greater where only rounding is left of a slope
uniform float middle;               // the value beside which there is half of what values are more
#endif
uniform mat3 to_eye;                // takes gradients, in the space that they are in, to eye space

// Gradient at a point of the ray, in eye space; of any length where only its direction is asked for.
vec3 slope_at(Ray ray, float t) {
#if GRADIENT == 2
    vec3 slope = sample3v(gradient, point_at(ray, t) + 1.0).xyz;
    vec3 size = abs(slope);
    // Zero is rounded, where whole numbers are stored about their middle, and any direction would come of it.
    return transform(to_eye, max(size.x, max(size.y, size.z)) > vanishing ? slope : vec3(0.0));
#elif GRADIENT
    return transform(to_eye, sample3v(gradient, point_at(ray, t)).xyz);
#else
    return transform(to_eye, gradient_central(volume, point_at(ray, t)));
#endif
}

// True where a gradient, and not only a value, is made of something that is not finite: that of whole numbers is, unless it
// was brought along.
bool is_lost(float magnitude) {
#if FINITE && GRADIENT != 1
    return false;
#else
    return isnan(magnitude) || isinf(magnitude);
#endif
}
#endif

// Value at a point of the ray; where its slope is asked for too, as where it is `lit`, from the same read as that.
float value_at(Ray ray, float t, bool lit) {
#if SLOPES
#if GRADIENT == 2
    return lit ? 2.0 * sample3v(gradient, point_at(ray, t) + 1.0).w + middle : sample3(volume, point_at(ray, t));
#endif
#endif
    return sample3(volume, point_at(ray, t));
}

// Colour of a point of the ray after illumination.
vec3 shade(vec3 color, Ray ray, float t) {
#if LIT
    vec3 point = ray.eye_origin + ray.eye_direction * t;
    return shade_phong(color, slope_at(ray, t), point, ray.eye_direction, light, material);
#else
    return color;
#endif
}
