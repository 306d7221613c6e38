// A ray from cell to cell. A kernel that includes this has an `add_cell` before it, which lays what one cell adds under
// the sum: `length` mm from `start`.

Result pixel(ivec2 at) {
    Begun begun = begin(at);
    Ray ray = begun.ray;
    Result result = begun.result;
    vec2 range = begun.range;
    if (!(range.y > range.x)) {
        return result;
    }
    vec3 per_unit = inverse_of(ray.direction);
    vec3 forward = mix(vec3(0.0), vec3(1.0), greaterThan(per_unit, vec3(0.0)));
    vec3 sense = 2.0 * forward - 1.0;
    vec3 last = whole_size() - 1.0;
    vec3 least = vec3(-1.0);
    vec3 most_cell = last;
#if CARRIED
    vec2 own = through_block(ray.origin, ray.direction);
    range = vec2(max(range.x, own.x), min(range.y, own.y));
    if (!(range.y > range.x)) {
        return result;
    }
    least = max(block_low, least);
    most_cell = min(block_high - 1.0, last);
#endif
    Sum sum = Sum(result.color.rgb, result.color.w, isinf(result.depth) ? NEVER : -NEVER);
    float t = range.x;
    vec3 cell = clamp(floor(ray.origin + ray.direction * t), least, most_cell);
    // Planes of the axes that the ray crosses next; outside the outermost voxels there are none.
    float steps = 0.0;
    float most = last.x + last.y + last.z + 8.0;
    while (t < range.y && sum.hidden < ENOUGH && steps < most) {
        vec3 exits = (cell + forward - ray.origin) * per_unit;
        float leave = min(exits.x, min(exits.y, exits.z));
        float stop = min(leave, range.y);
#if SKIP
        // That of any octant says it.
        vec3 b = floor((cell - bricks_corner()) / BRICK);
        b.z = clamp(b.z, 0.0, layers_of(bricks) - 1.0);
        bool seen = fetch3(bricks, ivec3(b)) < 0.0;
#else
        bool seen = true;
#endif
        if (stop > t && seen) {
            sum = add_cell(sum, ray, t, stop - t);
        }
        t = max(t, stop);
        // Exactly one axis a step, so that a ray through an edge crosses a cell of no length.
        if (exits.x <= leave) {
            cell.x += sense.x;
        } else if (exits.y <= leave) {
            cell.y += sense.y;
        } else {
            cell.z += sense.z;
        }
        steps += 1.0;
    }
    result.color = vec4(sum.color, sum.hidden);
    if (t < range.y && sum.hidden < ENOUGH && steps < most) {
        result.color = vec4(uintBitsToFloat(0x7fc00000u));  // the driver ended the loop
    }
    if (abs(sum.depth) < NEVER) {
        result.depth = (ray.start + sum.depth) * ray.cosine;
    }
    return result;
}
