"""A frame of a ray-caster: what every processor that casts rays by segments refuses, binds, decides and runs alike.

A processor makes one `Casting`, adds to its ``bindings`` and ``defines`` what it reads of its transfer function, and
lets it run: in one piece, or block by block where the volume does not fit (docs/decisions/0007-rays.md, 0009).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.compute import blockwise
from nodegraph.compute.storage import field_bytes
from nodegraph.data.bricks import Flags, Leaps
from nodegraph.data.buffer import Array, Buffer
from nodegraph.data.camera import Camera
from nodegraph.data.gradients import beforehand, index_gradient, middle, vanishing
from nodegraph.data.image import Image
from nodegraph.data.light import Light
from nodegraph.data.preintegration import gauss_rule
from nodegraph.data.quantisation import bound, is_finite, narrowest, stored
from nodegraph.data.volume import Volume
from nodegraph.errors import DeviceError, PortError

ENLARGE = "render/enlarge"
VALUE_ERROR = (
    "What values may be off by, as a share of the volume's range. Voxels are bound in the narrowest type that "
    "keeps it: 8 bits from 1/510 on, 16 from 1/131070, half floats from 1/8192 where some are not finite. Light "
    "follows the slopes of what is bound. 0 binds them as they are."
)
"""What the parameter ``value_error`` of a ray-caster says."""
SKIP_OPACITY = (
    "Bricks of 4 voxels in which nothing hides more than this over the least distance of voxels are left out, too, as "
    "noise beside what is looked for. Where no colour, with its light, is above 1, a ray misses at most "
    "1 - (1 - skip_opacity)^n along n such distances in them, give or take a step; of scattered noise far less. What "
    "stands behind may become the place of its depth. 0 leaves out only what cannot be seen."
)
"""What the parameter ``skip_opacity`` of a ray-caster says."""


def table(function: Any, *rows: int) -> Buffer:
    """``function.table(*rows)`` as a buffer: by `memo` it stays on the device from one picture to the next."""
    return Buffer(function.table(*rows))


def gauss_points(order: int) -> dict[str, Any]:
    """What shaders/common/gauss.glsl reads, for ``order`` points in a piece."""
    nodes, weights, before = gauss_rule(order)
    return {"nodes": nodes, "weights": weights, "before": before.ravel()}


class Narrowed(NamedTuple):
    """A volume in fewer bits, and how far off its values are, in its unit."""

    volume: Volume
    error: float


def narrowed(volume: Volume, max_error: float, api: str) -> Narrowed | None:
    """The volume in what takes the fewest bytes on a device and keeps ``max_error``; None where nothing takes fewer."""
    count = math.prod(volume.dims)
    storage = narrowest(volume, max_error, lambda name: field_bytes(count, np.dtype(name), api))
    return None if storage is None else Narrowed(stored(volume, storage), bound(volume, storage))


def within(
    value_error: float, volume: Volume, device: Any, memo: Callable[..., Any], explain: Callable[[str], None]
) -> Volume:
    """The volume to bind where values may be off by a share of its range; 0: as it is.

    Everything else that a ray-caster makes of a volume has to be made of this one: bricks, gradients, levels.
    """
    if value_error == 0.0:
        return volume
    if blockwise.is_needed(volume, device):
        explain("voxels are bound as they are: blocks know no value_error")
        return volume
    low, high = volume.range
    max_error = value_error * (high - low)
    allowed = f"{max_error:.3g} {volume.mapping.unit}".rstrip()
    found = memo(narrowed, volume, max_error, device.name)
    if found is None:
        explain(f"voxels are bound as {volume.dtype}: nothing that takes less keeps values within {allowed}")
        return volume
    types = (found.volume.dtype, volume.dtype)
    bytes_of = [field_bytes(math.prod(volume.dims), dtype, device.name) / 2**20 for dtype in types]
    explain(
        f"voxels are bound as {types[0]}, {bytes_of[0]:.3g} MiB instead of {bytes_of[1]:.3g}: values are off by at "
        f"most {found.error:.3g} of {allowed} allowed"
    )
    narrow: Volume = found.volume
    return narrow


class Casting:
    """One frame.

    size: of what is cast, pixels (w, h). step_length: mm. gradient: world-space, as it is wired, or None.
    level: is taken off all values, because single precision has no digits left far from zero.
    streamed: the volume does not fit, so blocks of it are rendered front to back.
    Raises PortError where the interval or the gradient does not fit the picture or the volume.
    """

    def __init__(
        self,
        device: Any,
        volume: Volume,
        camera: Camera,
        size: tuple[int, int],
        step: float,
        interval: Image | None = None,
        gradient: Volume | None = None,
    ) -> None:
        if interval is not None and interval.size != size:
            raise PortError(f"interval: expected {size[0]}x{size[1]} pixels, got {interval.size[0]}x{interval.size[1]}")
        if gradient is not None and not gradient.is_same_grid(volume):
            raise PortError("gradient: it lies on another grid than the volume; compute it from this volume")
        self.device, self.volume, self.camera, self.size = device, volume, camera, size
        self.voxel = float(volume.spacing.min())
        self.step_length = step * self.voxel
        # Rays start a whole number of steps from the eye, just before the volume: single precision counts from there.
        steps = max(0.0, math.floor(volume.distance_from(camera) / self.step_length) - 1.0)
        self.start = steps * self.step_length
        self.level = volume.origin
        self.streamed = blockwise.is_needed(volume, device)
        self.gradient = gradient
        self.bindings: dict[str, Any] = {"volume": volume.less(self.level), "step_length": self.step_length}
        self.defines: dict[str, Any] = {"INTERVAL": interval is not None, "FINITE": volume.dtype.kind in "iu"}
        if interval is not None:
            self.bindings |= {"interval": interval, "rounding": 8.0 * float(np.finfo(device.real).eps)}
        # Blocks are cut from the volume; so are its gradients and its bricks.
        self._differentiate: Callable[[Volume], Volume] | None = None
        self._blocks: blockwise.Cast | None = None

    @property
    def samples(self) -> float:
        """Segments of the longest ray."""
        corners = self.volume.corners
        return float(np.linalg.norm(corners[7] - corners[0])) / self.step_length

    @property
    def work(self) -> float:
        """How dear a pixel is: a few hundred segments are nothing out of the ordinary."""
        return max(self.samples / 500.0, 0.1)

    def extinction_of(self, opacity: float) -> float:
        """Per mm: what hides ``opacity`` over the least distance of voxels, and a rounding more.

        So values that hide just this much are not told apart by how rows of a table are rounded.
        """
        return -math.log1p(-opacity) / self.voxel * (1.0 + 1e-9)

    def leave_out(self, found: Flags | Leaps | None, skip_opacity: float, explain: Callable[[str], None]) -> float:
        """Look only into the bricks that are ``found``: into all where it is None. Returns their share.

        They are flags where blocks are rendered, which leap within themselves, and else say how far a ray may leap.
        """
        if found is None:
            explain("bricks are not asked for: nearly all of them can be seen")
            return 1.0
        self.defines["SKIP"] = True
        if isinstance(found, Leaps):
            self.bindings["bricks"] = found.reaches
        share = found.share if isinstance(found, Leaps) else float(found.mean())
        if skip_opacity > 0.0:
            explain(
                f"bricks that hide at most {skip_opacity:.3g} over a voxel are left out: {share:.1%} of all are not"
            )
        return share

    def interleave(self, whole: tuple[int, int]) -> None:
        """Cut neighbouring rays into segments at other places, where the picture will be enlarged to ``whole``.

        Each then misses other things, and enlarging takes means of them. Source: Keller and Heidrich 2001, Interleaved
        Sampling.
        """
        # Before an eye in the volume, or close to it, there is no room for steps that begin earlier.
        if self.size != whole and self.start > 0.0:
            self.defines |= {"PHASES": True}

    def illuminate(self, light: Light, **material: float) -> None:
        """Bind a lamp and ambient, diffuse, specular, shininess. Gradients are another matter."""
        self.bindings |= {"light": light.in_eye_space(self.camera), "material": material}
        self.defines |= {"LIT": True, "GLOSS": material["specular"] > 0.0}

    def to_eye(self) -> NDArray[np.float64]:
        """What turns the gradients that a kernel reads into eye space: those wired, or differences per index unit."""
        turned = self.camera.eye_to_world[:3, :3].T
        if self.gradient is not None:
            return turned
        result: NDArray[np.float64] = turned @ self.volume.world_to_index[:3, :3].T
        return result

    def choose_gradients(
        self,
        asked: str,
        shown: float,
        memo: Any,
        explain: Callable[[str], None],
        coarse: bool = False,
        decisive: bool = False,
    ) -> None:
        """Bind gradients, or let the kernel take differences; ``shown``: samples a frame that need one.

        A ``coarse`` picture, as interactive quality has it, takes those that a finer one has left. Where gradients are
        ``decisive`` for what is seen, and not only for its light, none are made beforehand beside voxels that are not
        finite: there they are not the same.
        """
        self.defines |= {"GRADIENT": 0 if self.gradient is None else 1}
        if self.gradient is not None:
            self.bindings |= {"gradient": self.gradient}
            return
        if decisive and asked == "automatic" and not self.streamed and not memo(is_finite, self.volume):
            explain("gradients are taken on the fly: some voxels are not finite, and decide what is seen beside them")
            return
        made, why = beforehand(
            asked, self.volume, shown, self.device, self.streamed,
            left=lambda: coarse and memo.kept(index_gradient, self.volume),
        )  # fmt: skip
        explain(f"gradients are {'precomputed' if made else 'taken on the fly'}: {why}")
        if made:
            # They have a voxel more on each side than what is wired, and values beside them.
            self.defines |= {"GRADIENT": 2}
            self.bindings |= {"vanishing": vanishing(self.volume), "middle": middle(self.volume) - self.level}
            if self.streamed:
                self._differentiate = partial(index_gradient, whole=self.volume)
            else:
                self.bindings |= {"gradient": memo(index_gradient, self.volume)}

    def lights_all(self, dense: bool) -> bool:
        """Whether segments are lit without asking which can be seen; ``dense``: nearly all can.

        On OpenGL rays wait for their neighbours' light, so that asking pays only where light takes more than the read
        that brings the value along (docs/decisions/0007-rays.md).
        """
        return dense or (self.defines["GRADIENT"] == 2 and self.device.name == "gl")

    def stream(
        self,
        kernel: str,
        explain: Callable[[str], None],
        *,
        visible: Flags | None,
        ranges: Volume | None = None,
        looks: float,
        carries_best: bool = False,
    ) -> None:
        """Prepare blocks, where the volume does not fit.

        visible: the groups of bricks in which something can be seen; ranges: their values, for a kernel that looks at
        them itself. looks: steps from the middle of a segment to the farthest point that is looked at for it.
        """
        if not self.streamed:
            return
        explain("the volume does not fit: it is read and rendered block by block, front to back")
        for name in ("volume", "gradient", "bricks"):
            self.bindings.pop(name, None)
        reach = self.step_length * float(np.linalg.norm(self.volume.world_to_index[:3, :3], axis=1).max())
        differs = "GRADIENT" in self.defines
        self._blocks = blockwise.Cast(
            kernel, self.size, self.volume, self.camera, self.defines, self.bindings,
            visible=None if visible is None else blockwise.each_brick(visible, self.volume.dims),
            ranges=None if ranges is None else ranges.data,
            gradient=self.gradient if differs else None, differentiate=self._differentiate,
            span=reach * looks, margin=1.5 * reach, differences=differs and self.gradient is None,
            level=self.level, hides=self.bindings.get("termination", 1.0), carries_best=carries_best,
        )  # fmt: skip

    def cast(
        self,
        kernel: str,
        turns: float,
        progress: Callable[[float], None],
        pixels: Array | None = None,
    ) -> Any:
        """Colour and depth of the rays of all pixels, or of some, (h, w, 2): column and row of each.

        turns: of loops that a ray takes at most. Blocks cast all pixels.
        """
        rays = self.camera.rays(self.size, self.volume.world_to_index, self.start)
        if self._blocks is not None:
            return blockwise.render(self._blocks, self.device, progress, camera=rays, work=self.work, turns=turns)
        given = {"work": self.work, "turns": turns, "camera": rays, **self.bindings}
        if pixels is None:
            return self.device.run(kernel, self.size, defines=self.defines, **given)
        grid, defines = pixels.shape[1::-1], self.defines | {"SPARSE": True}
        return self.device.run(kernel, grid, defines=defines, pixels=pixels, **given)

    def refuse_unfinished(self, result: Any, integrator: str) -> None:
        """Raise DeviceError where a kernel whose turns of loops are not known beforehand says that a loop was ended.

        It returns NaN for such a ray. ``integrator``: "adaptive", which goes by segments, or "cellwise".
        """
        if "turns" in self.device.limits and np.isnan(result.color.array).any():
            raise DeviceError(
                f"{integrator}: this driver ends loops after {self.device.limits['turns']} turns, too early for some "
                f"rays; use {'a greater step or tolerance' if integrator == 'adaptive' else 'another order'}, another "
                "integrator, or --device cl"
            )

    def picture(self, result: Any, whole: tuple[int, int]) -> Image:
        """What was cast, at the size that was asked for."""
        return enlarged(Image(result.color, result.depth), whole, self.device)


def enlarged(image: Image, whole: tuple[int, int], device: Any) -> Image:
    """A smaller picture of the same view, as `requests.coarser` has it, brought to the size that was asked for."""
    if image.size == whole:
        return image
    has_depth = image.depth_buffer is not None
    given = {"depth": image.depth_buffer} if has_depth else {}
    result = device.run(ENLARGE, whole, defines={"DEPTH": has_depth}, color=image.color_buffer, full=whole, **given)
    return Image(result.color, result.depth if has_depth else None)
