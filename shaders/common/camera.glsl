// Rays of a camera, in any space that the host chose (see Camera.rays in nodegraph/data/camera.py).
// Distances along a ray are always millimetres from the eye, or from the plane of the eye.

struct Camera {
    vec3 eye;           // in the chosen space
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
    float cosine;       // depth along the view axis = distance along the ray * cosine
    vec3 eye_origin;    // the same ray in eye space: x right, y up, z backwards, mm
    vec3 eye_direction; // unit vector
};

// Ray through the middle of pixel `at`; row 0 is the top.
Ray cast_ray(Camera camera, ivec2 at) {
    vec2 p = (vec2(at) + 0.5) / camera.pixels * 2.0 - 1.0;
    vec2 s = vec2(p.x, -p.y) * camera.half_size;
    vec3 offset = camera.right * s.x + camera.up * s.y;
    Ray ray;
    if (camera.orthographic) {
        ray.origin = camera.eye + offset;
        ray.direction = camera.forward;
        ray.cosine = 1.0;
        ray.eye_origin = vec3(s, 0.0);
        ray.eye_direction = vec3(0.0, 0.0, -1.0);
    } else {
        float cosine = inversesqrt(1.0 + dot(s, s));
        ray.origin = camera.eye;
        ray.direction = (camera.forward + offset) * cosine;
        ray.cosine = cosine;
        ray.eye_origin = vec3(0.0);
        ray.eye_direction = vec3(s, -1.0) * cosine;
    }
    return ray;
}

// Depth of a pixel that shows nothing.
float nothing() {
    return uintBitsToFloat(0x7f800000u);
}
