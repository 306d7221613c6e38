// Rays of a camera, in any space that the host chose (see Camera.rays in nodegraph/data/camera.py).
// Distances along a ray are millimetres from the sphere of radius `start` about the eye (orthographic: from the plane
// `start` before the eye). A host that sets it near the scene keeps all digits for a scene that is far from the eye.

struct Camera {
    vec3 eye;           // in the chosen space
    vec3 base;          // `start` mm before the eye, on the axis of the view
    float start;        // 0: distances are from the eye itself
    vec3 right;         // one world millimetre to the right, up and forward, in the chosen space
    vec3 up;
    vec3 forward;
    vec2 half_size;     // of the picture: tangents (perspective) or millimetres (orthographic)
    vec2 pixels;        // width and height of the picture
    bool orthographic;
};

struct Ray {
    vec3 origin;
    vec3 direction;     // per millimetre of world space
    float start;        // mm from the eye to the origin
    float cosine;       // depth along the view axis = distance from the eye * cosine
    vec3 eye_origin;    // the same ray in eye space: x right, y up, z backwards, mm
    vec3 eye_direction; // unit vector
};

// Ray through the middle of pixel `at`; row 0 is the top.
Ray cast_ray(Camera camera, ivec2 at) {
    vec2 p = (vec2(at) + 0.5) / camera.pixels * 2.0 - 1.0;
    vec2 s = vec2(p.x, -p.y) * camera.half_size;
    vec3 offset = camera.right * s.x + camera.up * s.y;
    Ray ray;
    ray.start = camera.start;
    if (camera.orthographic) {
        ray.origin = camera.base + offset;
        ray.direction = camera.forward;
        ray.cosine = 1.0;
        ray.eye_origin = vec3(s, -camera.start);
        ray.eye_direction = vec3(0.0, 0.0, -1.0);
    } else {
        float cosine = inversesqrt(1.0 + dot(s, s));
        ray.direction = (camera.forward + offset) * cosine;
        // eye + start * direction, by its small distance from the base: 1 - cosine = sine^2 / (1 + cosine).
        float lag = dot(s, s) * cosine * cosine / (1.0 + cosine);
        ray.origin = camera.base + (offset * cosine - camera.forward * lag) * camera.start;
        ray.cosine = cosine;
        ray.eye_direction = vec3(s, -1.0) * cosine;
        ray.eye_origin = ray.eye_direction * camera.start;
    }
    return ray;
}

// Depth of a pixel that shows nothing.
float nothing() {
    return uintBitsToFloat(0x7f800000u);
}
