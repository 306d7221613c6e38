// One block of a volume that is rendered block by block, front to back (docs/decisions/0009-out-of-core.md).
//
// Rays, segments and cells are those of the whole volume; `volume` holds the voxels that the block reads. A block owns
// the segments whose middle lies in it, and what it finds is laid over what the blocks before it left behind.

#ifndef CARRIED
#define CARRIED 0       // 1: `volume` is a block, and rays go on from where the blocks before it left them
#endif

#if CARRIED
const float BEYOND = 3.0e38;

uniform vec3 whole;             // voxels of the whole volume along each axis
uniform vec3 corner;            // of the whole volume, the voxel at which `volume` begins
uniform vec3 block_low;         // the space of the block; beyond anything at the outer faces of the volume
uniform vec3 block_high;
uniform vec3 block_bricks;      // of the whole volume, the voxel at which its bricks begin

// Where a ray comes into the block and where it leaves, mm from its origin; nothing where exit <= entry. A plane that two
// blocks share gives both the same number, so that none of the segments between them is lost or taken twice.
vec2 through_block(vec3 origin, vec3 direction) {
    vec2 range = vec2(-BEYOND, BEYOND);
    for (int i = 0; i < 3; ++i) {
        if (direction[i] == 0.0) {
            bool beside = origin[i] < block_low[i] || origin[i] >= block_high[i];
            range = beside ? vec2(BEYOND, -BEYOND) : range;
        } else {
            float per_unit = 1.0 / direction[i];
            float a = (block_low[i] - origin[i]) * per_unit;
            float b = (block_high[i] - origin[i]) * per_unit;
            range = vec2(max(range.x, min(a, b)), min(range.y, max(a, b)));
        }
    }
    return range;
}

// First and last segment whose middle lies in the block; none where last < first.
vec2 segments_of_block(vec3 origin, vec3 direction, float step_length) {
    vec2 range = through_block(origin, direction);
    return vec2(ceil(range.x / step_length - 0.5), ceil(range.y / step_length - 0.5) - 1.0);
}
#endif
