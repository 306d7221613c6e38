// Gradients of scalar fields, per index unit.

// Central differences over two voxels (Orhun 2004, OR-14). Six samples.
vec3 gradient_central(field3 volume, vec3 p) {
    return 0.5 * vec3(
        sample3(volume, p + vec3(1.0, 0.0, 0.0)) - sample3(volume, p - vec3(1.0, 0.0, 0.0)),
        sample3(volume, p + vec3(0.0, 1.0, 0.0)) - sample3(volume, p - vec3(0.0, 1.0, 0.0)),
        sample3(volume, p + vec3(0.0, 0.0, 1.0)) - sample3(volume, p - vec3(0.0, 0.0, 1.0)));
}

// Length of a vector whose square may leave single precision.
float magnitude_of(vec3 v) {
    vec3 size = abs(v);
    float largest = max(size.x, max(size.y, size.z));
    return largest > 0.0 && !isinf(largest) ? largest * length(v / largest) : largest;
}
