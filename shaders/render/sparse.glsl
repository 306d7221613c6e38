// Guess the pixels between those of a coarse grid, and say how far that may be trusted. Source: Orhun 2004, OR-60.
//
// Cell (i, j) has the pixels (i, j) and (i + 1, j + 1) of the coarse grid at its corners. Three pixels of the grid that
// is twice as fine are its own: in the middle of its upper edge, of its left edge, and of itself.
field2 color;
field2 depth;
uniform float tolerance;

struct Result {
    vec4 right;     // colour between the corner and the one to the right
    vec4 below;     // between the corner and the one below
    vec4 centre;
    vec4 depths;    // of these three, mm; w: how uneven the cell is, at most 1 where the guesses keep the tolerance
};

const float NEVER = 3.0e38;

// Four pixels in a row; or four such rows, of depths, which are single numbers.
struct Row {
    vec4 one;
    vec4 two;
    vec4 three;
    vec4 four;
};

// Beyond the edge of the picture it goes on in a straight line.
Row straight_on(Row row, int at, int last) {
    Row result = row;
    result.one = at < 1 ? 2.0 * row.two - row.three : row.one;
    result.three = at + 1 > last ? 2.0 * row.two - result.one : row.three;
    result.four = at + 2 > last ? 2.0 * result.three - row.two : row.four;
    return result;
}

Row transposed(Row r) {
    return Row(
        vec4(r.one.x, r.two.x, r.three.x, r.four.x), vec4(r.one.y, r.two.y, r.three.y, r.four.y),
        vec4(r.one.z, r.two.z, r.three.z, r.four.z), vec4(r.one.w, r.two.w, r.three.w, r.four.w));
}

ivec2 near(ivec2 at, int i, int j) {
    return clamp(at + ivec2(i, j), ivec2(0), size2(color) - 1);
}

// Four pixels below each other.
Row colors_of(ivec2 at, int i) {
    return Row(
        fetch2(color, near(at, i, -1)), fetch2(color, near(at, i, 0)),
        fetch2(color, near(at, i, 1)), fetch2(color, near(at, i, 2)));
}

vec4 depths_of(ivec2 at, int i) {
    return vec4(
        fetch2(depth, near(at, i, -1)).x, fetch2(depth, near(at, i, 0)).x,
        fetch2(depth, near(at, i, 1)).x, fetch2(depth, near(at, i, 2)).x);
}

vec4 total(Row row) {
    return row.one + row.two + row.three + row.four;
}

// The greatest second difference along four.
vec4 bend(Row row) {
    return max(abs(row.one - 2.0 * row.two + row.three), abs(row.two - 2.0 * row.three + row.four));
}

vec4 bends(Row a, Row b, Row c, Row d) {
    return max(max(bend(a), bend(b)), max(bend(c), bend(d)));
}

// The cubic through four, in their middle.
vec4 middle(Row row) {
    return 0.5625 * (row.two + row.three) - 0.0625 * (row.one + row.four);
}

float greatest(vec4 v) {
    return max(max(v.x, v.y), max(v.z, v.w));
}

// Light and opacity within their range, where a cubic shoots over it.
vec4 within(vec4 v) {
    return vec4(max(v.rgb, vec3(0.0)), clamp(v.w, 0.0, 1.0));
}

// What lies halfway between two pixels differs from their mean by half the second difference of the three. Where nothing
// is narrower than the coarse grid, no second difference of a finer grid is greater than those of the coarse one around
// it, be the picture smooth, bent or torn there. So half of what four by four pixels about a cell have along both axes
// bounds the error of one guess, and the whole that of a guess made of guesses. Pixels beyond the corners are asked too,
// since an edge may bend into a cell between two of them. The cubic, which errs less where the picture is smooth, is
// within a quarter of the bound of the mean.
Result pixel(ivec2 at) {
    ivec2 last = size2(color) - 1;
    Row one = straight_on(colors_of(at, -1), at.y, last.y);
    Row two = straight_on(colors_of(at, 0), at.y, last.y);
    Row three = straight_on(colors_of(at, 1), at.y, last.y);
    Row four = straight_on(colors_of(at, 2), at.y, last.y);
    vec4 down = bends(one, two, three, four);
    Row top = straight_on(Row(one.one, two.one, three.one, four.one), at.x, last.x);
    Row upper = straight_on(Row(one.two, two.two, three.two, four.two), at.x, last.x);
    Row lower = straight_on(Row(one.three, two.three, three.three, four.three), at.x, last.x);
    Row bottom = straight_on(Row(one.four, two.four, three.four, four.four), at.x, last.x);
    vec4 along = bends(top, upper, lower, bottom);
    Row across = Row(middle(top), middle(upper), middle(lower), middle(bottom));
    // Two pixels are in a straight line whatever they are, and a maximum may pass over what is not a number.
    bool known = last.x > 1 && last.y > 1 && !any(isnan(total(across)));
    float uneven = known ? greatest(along + down) / tolerance : NEVER;

    Result result;
    result.right = within(middle(upper));
    result.below = within(middle(Row(top.two, upper.two, lower.two, bottom.two)));
    result.centre = within(middle(across));

    // The same for depths, as a share of the nearest; or nothing is there at all.
    Row depths = Row(depths_of(at, -1), depths_of(at, 0), depths_of(at, 1), depths_of(at, 2));
    vec4 least = min(min(depths.one, depths.two), min(depths.three, depths.four));
    float nearest = min(min(least.x, least.y), min(least.z, least.w));
    result.depths = vec4(vec3(nearest), uneven);
    if (!isinf(nearest)) {
        Row columns = straight_on(depths, at.x, last.x);
        Row rows = straight_on(transposed(columns), at.y, last.y);
        float bent = greatest(bend(columns)) + greatest(bend(rows));
        vec4 sums = total(depths);
        bool finite = !isinf(greatest(abs(sums))) && !any(isnan(sums));
        float share = bent > 0.0 ? bent / (tolerance * nearest) : 0.0;
        vec4 halfway = middle(rows);
        result.depths.x = middle(transposed(rows)).y;
        result.depths.y = halfway.y;
        result.depths.z = middle(transposed(Row(halfway, halfway, halfway, halfway))).x;
        result.depths.w = finite ? max(uneven, share) : NEVER;
    }
    return result;
}
