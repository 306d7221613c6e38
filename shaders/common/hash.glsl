// Random-looking numbers from integers: the same on every device and in every run.

// Mixes the bits of a number (the "lowbias32" of Wellons 2018).
uint hash(uint x) {
    x = (x ^ (x >> 16u)) * 2146121005u;
    x = (x ^ (x >> 15u)) * 2221713035u;
    return x ^ (x >> 16u);
}

uint hash_pixel(ivec2 at, uint seed) {
    return hash(uint(at.x) + hash(uint(at.y) + hash(seed)));
}

// The upper 24 bits as a float in 0..1 (1 excluded): exact in single precision.
float unit_float(uint x) {
    return float(x >> 8u) / 16777216.0;
}
