"""The other renderers and the filters at the same extremes."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import Camera, Mapping, Plane, TransferFunction, Volume
from nodegraph.data.mesh import box
from nodegraph.data.space import affine, centred, transform_points
from tests.extremes.case import case, matter, ones, relative, render, worst
from tests.support import raycast_twin as twin
from tests.support.calls import call

SLICE = "Slices"
GRADIENT = "Gradients"
BLUR = "Gaussian blur"
INTERVAL = "Entry and exit points"
SLOPE = np.array([2.0, -1.0, 3.0])  #: of the affine field, per unit of length of the scene


def affine_field(spacing: Any = (1.0, 1.5, 2.0), origin: Any = (0.0, 0.0, 0.0), scale: float = 1.0) -> Volume:
    """SLOPE . (p - origin) / scale at each voxel centre p, 12 x 10 x 8 voxels, spacing times ``scale``, double."""
    grid = affine((1, 1, 1), origin) @ np.diag([scale, scale, scale, 1.0]) @ centred((12, 10, 8), spacing)
    z, y, x = np.meshgrid(*(np.arange(n) for n in (8, 10, 12)), indexing="ij")
    local = transform_points(centred((12, 10, 8), spacing), np.stack([x, y, z], -1))
    return Volume(local @ SLOPE, grid)


SCENES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("spacing 1 : 0.002 : 2", {"spacing": (1.0, 0.002, 2.0)}),
    ("a volume 1 nm wide", {"scale": 1e-6 / 12}),
    ("a volume 1 m wide", {"scale": 1e3 / 12}),
    ("1e6 mm from the origin", {"origin": (1e6, -2e6, 5e5)}),
)


def slice_error(how: dict[str, Any], device: Any) -> float:
    """A slanted plane through the middle; grey is the value over the greatest."""
    volume = affine_field(**how)
    normal = np.array([0.3, -0.5, 0.8])
    plane = Plane(volume.centre, normal)
    greatest = float(np.abs(volume.data).max())
    size = (11, 9)
    height = 4.0 * float(volume.spacing.min())
    image = call("render.slice", device, size, volume=volume, plane=plane, height=height, window=(-greatest, greatest))
    right, up = plane.axes
    ys, xs = np.mgrid[: size[1], : size[0]]
    pixel = height / size[1]
    across = (xs - (size[0] - 1) / 2)[..., None] * pixel * right - (ys - (size[1] - 1) / 2)[..., None] * pixel * up
    value = across @ SLOPE / how.get("scale", 1.0)
    return worst(image.color[..., 0], (value / greatest + 1) / 2)


for told, how in SCENES:
    case(SLICE, told, "the values of an affine field", single=2e-6, double=1e-9)(partial(slice_error, how))


def grey(device: Any, volume: Volume, y: float, size: tuple[int, int] = (4, 3), **look: Any) -> np.ndarray:
    """A slice across y, wholly inside."""
    plane = Plane((0, y, 0), (0, -1, 0))
    return np.asarray(call("render.slice", device, size, volume=volume, plane=plane, height=1.0, **look).color)


def policy_error(bad: float, device: Any) -> float:
    """The third of five slices is bad: transparent from the second to the fourth, in both ways of colouring."""
    data = np.full((4, 5, 4), 0.25, np.float32)
    data[2, 2, 2] = bad
    tf = TransferFunction([(0.0, (1, 1, 1), 0.75), (1.0, (1, 1, 1), 0.75)])
    error = 0.0
    for look, visible in (
        ({"window": (0.0, 1.0)}, [0.25, 0.25, 0.25, 1.0]),
        ({"coloring": "transfer_function", "transfer_function": tf}, [0.75] * 4),
    ):
        for y, expected in ((-1.1, visible), (-0.9, [0.0] * 4), (0.9, [0.0] * 4), (1.1, visible)):
            found = grey(device, Volume(data), y, size=(1, 1), **look)
            error = max(error, worst(found[0, 0], expected))
    return error


for name, bad in (("nan", np.nan), ("inf", np.inf), ("-inf", -np.inf)):
    case(SLICE, f"a voxel that is {name}", "the cells around it are transparent", single=1e-6, double=1e-9)(
        partial(policy_error, bad)
    )


@case(SLICE, "a constant volume and its own range as window", "black: a window without width is a threshold", single=0,
      double=0)  # fmt: skip
def constant_slice(device: Any) -> float:
    return worst(grey(device, ones((4, 4, 4)), 0.0), [0.0, 0.0, 0.0, 1.0])


@case(SLICE, "exactly in the outer face, and a rounding outside", "the voxels there; nothing", single=1e-6, double=1e-9)
def face_slice(device: Any) -> float:
    inside = worst(grey(device, ones((4, 4, 4)), -2.0, window=(0.0, 2.0)), [0.5, 0.5, 0.5, 1.0])
    outside = worst(grey(device, ones((4, 4, 4)), -2.00001, window=(0.0, 2.0)), 0.0)
    return max(inside, outside)


@case(SLICE, "one voxel", "fills its spacing", single=1e-6, double=1e-9)
def voxel_slice(device: Any) -> float:
    return worst(
        grey(device, ones((1, 1, 1), centred((1, 1, 1), (4, 4, 4))), 1.9, window=(0.0, 2.0)), [0.5] * 3 + [1.0]
    )


@case(SLICE, "int16 from -32768 to 32767", "black and white", single=1e-6, double=1e-9)
def integers_slice(device: Any) -> float:
    data = np.array([-32768, 32767], np.int16)[None, :, None].repeat(2, 0).repeat(2, 2)
    black = worst(grey(device, Volume(data), -0.75), [0, 0, 0, 1])
    return max(black, worst(grey(device, Volume(data), 0.75), 1.0))


@case(SLICE, "float64 at 1e9, a range of 1", "all of the range", single=1e-6, double=2e-7)
def offset_slice(device: Any) -> float:
    data = np.broadcast_to(np.linspace(1e9, 1e9 + 1, 5)[None, :, None], (4, 5, 4)).copy()
    return worst(grey(device, Volume(data), 0.5, window=(1e9, 1e9 + 1))[..., 0], 0.625)


@case(SLICE, "16384 x 1 pixels", "the values of an affine field", single=2e-6, double=1e-9)
def wide_slice(device: Any) -> float:
    data = np.broadcast_to(np.arange(8.0)[None, None, :], (4, 4, 8)).astype(np.float32)
    size = (16384, 1)
    image = call("render.slice", device, size, volume=Volume(data), plane=Plane((0, 0, 0), (0, -1, 0)),
                 height=6.0 / size[0], window=(0.0, 8.0))  # fmt: skip
    x = (np.arange(size[0]) + 0.5) / size[0] * 6.0 - 3.0
    return worst(np.sort(image.color[0, :, 0]), (x + 3.5) / 8.0)


# -- gradients --------------------------------------------------------------------------------------------------------


def gradient_error(how: dict[str, Any], method: str, device: Any) -> float:
    """That of an affine field is the same everywhere, borders included; relative to its length."""
    volume = affine_field(**how)
    found = call("filter.gradient", device, volume=volume, method=method).data
    expected = np.array([*SLOPE, np.linalg.norm(SLOPE)])
    return worst(found * how.get("scale", 1.0) / expected[3], expected / expected[3])


for told, how in SCENES:
    for method in ("central", "sobel"):
        case(
            GRADIENT, f"{told}, {method}", "that of an affine field", single=1e-3 if "0.002" in told else 1e-5,
            double=1e-9, unit="relative",
        )(partial(gradient_error, how, method))  # fmt: skip


@case(GRADIENT, "float64 at 1e9, slopes of 1e-3", "that of an affine field", single=2e-6, double=2e-6, unit="1/mm")
def offset_gradient(device: Any) -> float:
    volume = affine_field()
    far = Volume(volume.data * 1e-3 + 1e9, volume.index_to_world)
    # The values themselves are rounded to 1e-7, and differences of two of them to as much over 2 mm.
    return worst(call("filter.gradient", device, volume=far).data[..., :3], SLOPE * 1e-3)


@case(
    GRADIENT,
    "one voxel, one slice, a constant volume",
    "0 along axes that have no neighbour",
    single=0,
    double=0,
    unit="1/mm",
)
def thin_gradient(device: Any) -> float:
    found = [call("filter.gradient", device, volume=ones(dims), method=method).data
             for dims in ((1, 1, 1), (5, 4, 1), (2, 2, 2)) for method in ("central", "forward", "sobel")]  # fmt: skip
    return max(worst(values, 0.0) for values in found)


@case(GRADIENT, "int16 from -32768 to 32767 in one voxel", "the whole range per mm", single=1e-2, double=1e-9,
      unit="1/mm")  # fmt: skip
def steep_gradient(device: Any) -> float:
    data = np.array([-32768, 32767], np.int16)[None, None, :]
    return worst(call("filter.gradient", device, volume=Volume(data)).data[..., [0, 3]], 65535.0)


def spoiled_gradient(bad: float, device: Any) -> float:
    """Not a number where a difference needs the bad voxel, in all four components, and untouched elsewhere."""
    volume = affine_field(spacing=(1, 1, 1))
    data = np.array(volume.data, np.float32)
    data[4, 5, 6] = bad
    found = call("filter.gradient", device, volume=Volume(data)).data
    beside = np.zeros(data.shape, bool)
    for z, y, x in ((3, 5, 6), (5, 5, 6), (4, 4, 6), (4, 6, 6), (4, 5, 5), (4, 5, 7)):
        beside[z, y, x] = True
    if not np.isnan(found[beside][:, 3]).all() or np.isinf(found).any():
        return float("inf")
    return worst(found[~beside], np.array([*SLOPE, np.linalg.norm(SLOPE)]))


for name, bad in (("nan", np.nan), ("inf", np.inf), ("-inf", -np.inf)):
    case(GRADIENT, f"a voxel that is {name}", "no gradient in its neighbours, the right one elsewhere", single=1e-4,
         double=1e-4, unit="1/mm")(partial(spoiled_gradient, bad))  # fmt: skip

# -- blur -------------------------------------------------------------------------------------------------------------


def blurred(volume: Volume, sigma: float) -> np.ndarray:
    return np.asarray(call("filter.gaussian_blur", volume=volume, sigma=sigma).real(np.float64))


def blur_constant(volume: Volume, sigma: float, device: Any) -> float:
    """The mean of equal numbers is that number."""
    value = float(volume.real(np.float64).flat[0])
    return relative(blurred(volume, sigma), value)


EQUAL = (
    ("a sigma of 0", ones((4, 4, 4)), 0.0),
    ("a sigma of 1e9 mm", ones((4, 5, 6)), 1e9),
    ("spacing 1 : 0.002 : 2", ones((4, 5, 6), centred((4, 5, 6), (1, 0.002, 2))), 0.01),
    ("voxels of 1e-7 mm", ones((4, 5, 6), centred((4, 5, 6), [1e-7] * 3)), 2e-7),
    ("one voxel", ones((1, 1, 1)), 3.0),
    ("int16 of -32768", Volume(np.full((3, 3, 3), -32768, np.int16)), 1.0),
    ("uint32 of 2^32 - 1", Volume(np.full((3, 3, 3), 2**32 - 1, np.uint32)), 1.0),
    ("float64 of 1e9 + 0.25", Volume(np.full((3, 3, 3), 1e9 + 0.25)), 1.0),
)
for told, volume, sigma in EQUAL:
    case(BLUR, f"{told}, equal values", "the same values", single=1e-6, double=1e-6, unit="relative")(
        partial(blur_constant, volume, sigma)
    )


@case(BLUR, "float64 at 1e9, an impulse of 1", "as wide and as high as at 0", single=1e-6, double=1e-6, unit="value")
def blur_offset(device: Any) -> float:
    data = np.zeros((9, 9, 9))
    data[4, 4, 4] = 1.0
    return worst(blurred(Volume(data + 1e9), 1.0) - 1e9, blurred(Volume(data), 1.0))


@case(BLUR, "int16 with an offset of 1e6 and a scale of 1e-4", "as wide and as high as at 0", single=1e-6, double=1e-6,
      unit="value")  # fmt: skip
def blur_mapped(device: Any) -> float:
    data = np.zeros((9, 9, 9), np.int16)
    data[4, 4, 4] = 10000
    return worst(blurred(Volume(data, mapping=Mapping(1e-4, 1e6)), 1.0) - 1e6,
                 blurred(Volume(data, mapping=Mapping(1e-4)), 1.0))  # fmt: skip


def blur_spoiled(bad: float, device: Any) -> float:
    """The mean of the others, which are equal."""
    data = np.full((7, 7, 7), 2.5, np.float32)
    data[3, 3, 3] = bad
    return relative(blurred(Volume(data), 1.0), 2.5)


for name, bad in (("nan", np.nan), ("inf", np.inf), ("-inf", -np.inf)):
    case(BLUR, f"a voxel that is {name} among equal ones", "the mean of the others", single=1e-6, double=1e-6,
         unit="relative")(partial(blur_spoiled, bad))  # fmt: skip

# -- entry and exit points --------------------------------------------------------------------------------------------


def interval_error(place: Any, camera: Camera, half: float, device: Any) -> float:
    """A cube against the slabs of numpy, relative to the distances of its far corners.

    A ray that runs in a face or touches an edge may be kept or refused: both are a rounding from it.
    """
    volume = ones((2, 2, 2), affine((1, 1, 1), place) @ centred((2, 2, 2), [half] * 3))
    size = (9, 7)
    found = call("render.entry_exit_points", device, size, geometry=box(volume.corners), camera=camera).color
    hits = []
    for zoom in (1.0, 1.0 - 1e-5, 1.0 + 1e-5):
        view = camera.with_(height=camera.height * zoom, field_of_view=min(camera.field_of_view * zoom, 179.999))
        _, _, _, entry, exit = twin.bounds(volume, view, size)
        hits.append(np.where((exit > entry)[..., None], np.stack([entry, exit], -1), 0.0))
    error = np.abs(found - hits[0]).max(axis=-1)
    inside, outside = ((hit > 0).any(axis=-1) for hit in hits[1:])
    touched = inside != outside
    kept = np.abs(found - hits[1]).max(axis=-1) - 1e-4 * np.abs(hits[1]).max()
    error[touched] = np.minimum(np.maximum(kept, 0), np.abs(found).max(axis=-1))[touched]
    return worst(error, 0.0) / float(hits[0].max())


HERE = np.zeros(3)
FAR = np.array([1e6, -2e6, 5e5])
VIEWS: tuple[tuple[str, Any, Camera, float], ...] = (
    ("1e6 mm from the origin", FAR, Camera(eye=FAR + np.array([3, -9, 4]), target=FAR, field_of_view=40.0), 2.0),
    ("a cube of 1 nm", HERE, Camera(eye=np.array([3, -9, 4]) * 1e-6, target=HERE, field_of_view=40.0), 1e-6),
    ("a cube of 1e9 mm", HERE, Camera(eye=np.array([3, -9, 4]) * 1e9, target=HERE, field_of_view=40.0), 1e9),
    ("the eye inside", HERE, Camera(eye=(0.1, 0.2, 0.3), target=(0, 1, 0), field_of_view=60.0), 2.0),
    ("the eye on a face", HERE, Camera(eye=(0.1, -2.0, 0.3), target=(0, 1, 0), field_of_view=60.0), 2.0),
    ("the eye on a corner", HERE, Camera(eye=(-2, -2, -2), target=(0, 1, 0), field_of_view=60.0), 2.0),
    ("179.99 degrees from inside", HERE, Camera(eye=(0.1, 0.2, 0.3), target=(0, 1, 0), field_of_view=179.99), 2.0),
    ("along an axis, rays in the faces", HERE,
     Camera(eye=(0, -9, 0), target=HERE, projection="orthographic", height=4 * 7 / 6), 2.0),
    ("along the diagonal", HERE, Camera(eye=(-9, -9, -9), target=HERE, projection="orthographic", height=3.0), 2.0),
)  # fmt: skip
for told, place, camera, half in VIEWS:
    case(INTERVAL, told, "the slabs of numpy", single=2e-6, double=1e-9, unit="relative")(
        partial(interval_error, place, camera, half)
    )


@case(INTERVAL, "the eye 1e9 mm away", "as many digits of the distance as single precision has", single=2e-7,
      double=1e-12, unit="relative")  # fmt: skip
def far_interval(device: Any) -> float:
    camera = Camera(eye=(0, -1e9, 0), target=HERE, projection="orthographic", height=1.0)
    found = call("render.entry_exit_points", device, (3, 3), geometry=box(ones((4, 4, 4)).corners), camera=camera).color
    return relative(found, [1e9 - 2, 1e9 + 2])


def seen_through(distance: float, device: Any) -> float:
    """A picture through the entry and exit points of the whole volume, beside the one without them."""
    volume = ones((4, 4, 4))
    angle = float(np.degrees(2 * np.arctan(3.0 / distance)))
    camera = Camera(eye=np.array([0.3, -1.0, 0.4]) * distance, target=HERE, field_of_view=angle)
    look = {"volume": volume, "camera": camera, "transfer_function": matter(0.2)}
    found = call("render.entry_exit_points", device, (6, 5), geometry=box(volume.corners), camera=camera)
    whole = np.asarray(render(device, (6, 5), **look).color)
    assert whole[..., 3].max() > 0.1
    return worst(render(device, (6, 5), interval=found, **look).color, whole)


for distance in (1e6, 1e9):
    case(INTERVAL, f"a ray-caster behind them, {distance:g} mm away", "the picture of the whole volume", single=1e-6,
         double=1e-9)(partial(seen_through, distance))  # fmt: skip
