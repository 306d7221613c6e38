"""Rays through a volume that does not fit a device: block by block, front to back (docs/decisions/0009-out-of-core.md).

A kernel that is built with CARRIED renders the segments that a block owns and lays them over what the blocks before it
left. What is carried from block to block are two pictures on the device that are read and written in turn, only where
this block or the one before may have changed them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.compute.storage import share_range
from nodegraph.data.blocks import BLOCK, Block, Pixels, block_counts, front_to_back, pixels_of
from nodegraph.data.bricks import BRICK, Flags, brick_counts, brick_reaches
from nodegraph.data.buffer import Array, Buffer
from nodegraph.data.camera import Camera
from nodegraph.data.chunks import ROOM_SHARE, free_bytes
from nodegraph.data.volume import Volume
from nodegraph.errors import DeviceError

GROUP = 2
"""Bricks along each axis that share one range, where a volume is large: at 1024^3 voxels 34 MB and not 268."""

COPIES = 4
"""Blocks that have to fit a device: the one that is rendered, what it is made of, and the next."""

CHUNK_SHARE = 0.2
"""Of the budget, what the unpacked chunks of a file may take that are kept for the next block."""

LOOK = 8
"""Blocks between two looks at what is hidden already."""

BEYOND = 3e38


class Rendered(NamedTuple):
    """A picture: colour (h, w, 4), depth (h, w)."""

    color: Buffer
    depth: Buffer


def nothing_seen(size: tuple[int, int], real: Any) -> Rendered:
    """The picture of nothing."""
    width, height = size
    return Rendered(Buffer(np.zeros((height, width, 4), real)), Buffer(np.full((height, width), np.inf, real)))


@dataclass(frozen=True)
class Cast:
    """What the blocks of one picture have in common.

    visible:       the visible bricks (z, y, x); None where nobody asks.
    ranges:        least and greatest value of groups of `GROUP` bricks, for a kernel that looks at them itself.
    gradient:      of the whole volume. ``differentiate`` makes that of what a block reads, where none is bound.
    span:          how far from its middle a segment is looked at, voxels.
    margin:        how far outside of its block that middle may lie at the outer faces, voxels.
    differences:   the kernel, or ``differentiate``, looks at the neighbours of voxels.
    level:         is taken off all values.
    hides:         a pixel that has hidden so much is finished.
    carries_best:  the kernel carries the greatest value and its place, not colour and depth.
    """

    kernel: str
    size: tuple[int, int]
    volume: Volume
    camera: Camera
    defines: Mapping[str, Any]
    bindings: Mapping[str, Any]
    visible: Flags | None = None
    ranges: NDArray[np.float64] | None = None
    gradient: Volume | None = None
    span: float = 0.0
    margin: float = 0.0
    differentiate: Callable[[Volume], Volume] | None = None
    differences: bool = False
    level: float = 0.0
    hides: float = 1.0
    carries_best: bool = False

    @property
    def reach(self) -> int:
        """Voxels that are read around a block: for the ends of segments, for differences, and one for rounding."""
        return math.ceil(self.span) + 1 + self.differences

    def first_state(self, real: Any) -> dict[str, Any]:
        """What rays carry before the first block."""
        width, height = self.size
        if self.carries_best:
            return {"carried_best": np.full((height, width, 2), (-BEYOND, 0.0), real)}
        nothing = nothing_seen(self.size, real)
        return {"carried": nothing.color, "carried_depth": nothing.depth}


def is_needed(volume: Volume, device: Any) -> bool:
    """Whether a volume is too large to be rendered in one piece, on the device or, where it lies in chunks, here."""
    z, y, x = volume.buffer.shape[:3]
    if not device.fits((z, y, x), volume.dtype):
        return True
    if volume.buffer.chunks is None:
        return False
    # What is read of chunks lies on the host as well.
    rooms = [] if device.budget is None else [device.budget]
    rooms += [] if (free := free_bytes()) is None else [free]
    return any(2 * volume.buffer.nbytes > ROOM_SHARE * room for room in rooms)


def block_size(volume: Volume, reach: int, device: Any) -> int:
    """Cells along the edge of a block: the most that fits, some of them at a time. DeviceError where none does.

    The chunks of a file that are kept count in the budget, too, so they get a share of it and no more.
    """
    kept = 0 if device.budget is None else volume.buffer.keep_at_most(int(CHUNK_SHARE * device.budget))
    size = BLOCK
    while size >= BRICK:
        side = size + 1 + 2 * reach
        layer = side * side * volume.dtype.itemsize
        if device.fits((COPIES * side + -(-kept // layer), side, side), volume.dtype):
            return size
        size //= 2
    raise DeviceError(
        f"{device.name}: blocks of {BRICK} cells with {reach} voxels around them do not fit its memory; "
        "raise the budget, or use a shorter step or the integrator midpoint"
    )


def each_brick(values: Array, dims: tuple[int, int, int]) -> Array:
    """What is known of groups of bricks (z, y, x, ...) for each brick of a grid of ``dims`` voxels."""
    for axis, count in enumerate(brick_counts(dims)[::-1]):
        values = np.repeat(values, GROUP, axis=axis).take(range(count), axis=axis)
    return values


def render(
    cast: Cast, device: Any, progress: Callable[[float], None], size: int | None = None, **bindings: Any
) -> Rendered:
    """Run the kernel over all blocks that may be seen and return the picture.

    At most two blocks are on the host at a time: the next one is read while this one is rendered. Cancelled, errors of
    files and of the device come through.
    """
    volume = cast.volume
    size = block_size(volume, cast.reach, device) if size is None else size
    blocks = list(front_to_back(volume, cast.camera, cast.visible, size, cast.reach, cast.span))
    state = cast.first_state(device.real)
    spare: tuple[Any, ...] = ()
    result: tuple[Any, ...] = ()
    touched: Pixels = (0, 0, 0, 0)
    hidden: Array | None = None
    turn = 0
    with ThreadPoolExecutor(1, "blocks") as reader:
        coming = iter(_on_screen(cast, blocks))
        ahead = _read_next(reader, cast, coming, hidden, size)
        while ahead is not None:
            done, box, future = ahead
            own = future.result()
            ahead = _read_next(reader, cast, coming, hidden, size)
            found = device.run(
                cast.kernel,
                cast.size,
                defines={**cast.defines, "CARRIED": True},
                box=_hull(touched, box),
                into=spare,
                progress=lambda fraction, done=done: progress((done + fraction) / len(blocks)),
                **cast.bindings,
                **bindings,
                **own,
                **state,
            )
            # What was read becomes what the next but one is written into, where both differ in these pixels alone.
            spare, result, touched = result, tuple(found), box
            if cast.carries_best:
                state = {"carried_best": found.best}
            else:
                state = {"carried": found.color, "carried_depth": found.depth}
                turn += 1
                if cast.hides <= 1.0 and turn % LOOK == 0:
                    hidden = np.asarray(found.color.array[..., 3] >= cast.hides)
    return Rendered(*result[:2]) if result else nothing_seen(cast.size, device.real)


Ahead = tuple[int, Pixels, "Future[dict[str, Any]]"]


def _on_screen(cast: Cast, blocks: list[Block]) -> Iterator[tuple[int, Block, Pixels]]:
    for i, block in enumerate(blocks):
        box = pixels_of(block, cast.volume, cast.camera, cast.size, cast.margin)
        if box is not None:
            yield i, block, box


def _read_next(
    reader: ThreadPoolExecutor,
    cast: Cast,
    coming: Iterator[tuple[int, Block, Pixels]],
    hidden: Array | None,
    size: int,
) -> Ahead | None:
    """Begin to read the next block of which something may be seen; None after the last."""
    for i, block, box in coming:
        left, top, right, bottom = box
        if hidden is None or not hidden[top:bottom, left:right].all():
            return i, box, reader.submit(_read, cast, block, size)
    return None


def _read(cast: Cast, block: Block, size: int) -> dict[str, Any]:
    """Everything that a kernel is told of a block."""
    part = _copied(cast.volume, block)
    if part.dtype.itemsize > 2 and part.dtype != np.float32:
        low, high = sorted((end - part.mapping.offset) / part.mapping.scale for end in cast.volume.range)
        share_range(part.buffer, low, high)
    own = {"volume": part.less(cast.level)} | _place(cast, block, size)
    if cast.gradient is not None:
        own["gradient"] = _copied(cast.gradient, block)
    elif cast.differentiate is not None:
        own["gradient"] = cast.differentiate(part)
    return own


def _copied(volume: Volume, block: Block) -> Volume:
    """The voxels that a block reads, in memory: a view of a mapped file would be read when it is drawn."""
    part = volume.part(block.first, block.stop)
    return Volume(np.ascontiguousarray(part.data), part.index_to_world, part.mapping)


def _place(cast: Cast, block: Block, size: int) -> dict[str, Any]:
    """Where a block lies and what of it can be seen."""
    counts = block_counts(cast.volume.dims, size)
    outer = [(at == 0, at == count - 1) for at, count in zip(block.place, counts, strict=True)]
    own: dict[str, Any] = {
        "whole": [float(n) for n in cast.volume.dims],
        "corner": [float(n) for n in block.first],
        "block_low": [-BEYOND if first else low for low, (first, _) in zip(block.low, outer, strict=True)],
        "block_high": [BEYOND if last else high for high, (_, last) in zip(block.high, outer, strict=True)],
    }
    per_block = size // BRICK
    if cast.visible is not None:
        z, y, x = (slice(at * per_block, (at + 1) * per_block) for at in block.place[::-1])
        own["bricks"] = Volume(brick_reaches(cast.visible[z, y, x], quickly=True))  # for one frame
    elif cast.ranges is not None:
        ends = brick_counts(cast.volume.dims)[::-1]
        here = [
            np.arange(at * per_block, min((at + 1) * per_block, end)) // GROUP
            for at, end in zip(block.place[::-1], ends, strict=True)
        ]
        own["bricks"] = Volume(cast.ranges[np.ix_(*here)]).less(cast.level)
    if "bricks" in own:
        own["block_bricks"] = [float(at * size) for at in block.place]
    return own


def _hull(a: Pixels, b: Pixels) -> Pixels:
    if a[0] >= a[2]:
        return b
    return min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3])
