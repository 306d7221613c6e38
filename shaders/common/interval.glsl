// Parts of a ray inside convex regions, as (entry, exit) distances; nothing is left when exit <= entry.

// Between two parallel planes, along one axis. A ray that does not move along it is kept or refused whole.
vec2 intersect_slab(float origin, float direction, float low, float high, vec2 range) {
    if (direction == 0.0) {
        return origin < low || origin > high ? vec2(range.x) : range;
    }
    float a = (low - origin) / direction;
    float b = (high - origin) / direction;
    return vec2(max(range.x, min(a, b)), min(range.y, max(a, b)));
}

// Inside the box low..high.
vec2 intersect_box(vec3 origin, vec3 direction, vec3 low, vec3 high, vec2 range) {
    vec2 result = intersect_slab(origin.x, direction.x, low.x, high.x, range);
    result = intersect_slab(origin.y, direction.y, low.y, high.y, result);
    return intersect_slab(origin.z, direction.z, low.z, high.z, result);
}

// On the inner side of a plane: normal . p + offset <= 0.
vec2 intersect_plane(vec3 origin, vec3 direction, vec4 plane, vec2 range) {
    float height = dot(plane.xyz, origin) + plane.w;
    float rate = dot(plane.xyz, direction);
    if (rate == 0.0) {
        return height > 0.0 ? vec2(range.x) : range;
    }
    float t = -height / rate;
    return rate > 0.0 ? vec2(range.x, min(range.y, t)) : vec2(max(range.x, t), range.y);
}
