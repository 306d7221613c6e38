"""Small values of every type: ordinary ones, odd ones, and for each parameter one that is not its default."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nodegraph import data, params
from nodegraph.data.mesh import box
from nodegraph.errors import ParameterError, PortError
from nodegraph.params import Parameter
from nodegraph.ports import Input
from nodegraph.processor import Processor
from nodegraph.testing.bench import SIZE

DIMS = (6, 5, 4)  #: voxels (x, y, z) of the sample grids

#: Looks at the sample grids from so near that every ray of a small picture may meet them.
CAMERA = data.Camera(eye=(2.0, -25.0, 3.0))
TABLE = data.TransferFunction([(0.0, (1.0, 0.5, 0.0), 0.0), (1.0, (1.0, 1.0, 1.0), 0.5)])
AREAS = data.TransferFunction2D([data.Trapezoid.rectangle((0.0, 1.0), (0.0, 1.0), (1.0, 0.5, 0.0), 0.5)])

_WORLD = np.array([[1.0, 0.0, 0.0, -3.0], [0.0, 1.5, 0.0, -3.0], [0.0, 0.0, 2.0, -4.0], [0.0, 0.0, 0.0, 1.0]])


def sample(port: Input) -> Any:
    """An ordinary value for an input, such that its conditions hold. Raises TypeError where none is known."""
    for value in _ordinary(port.type):
        try:
            return port.check((value, value) if port.many else value, port.name)
        except PortError:
            continue
    raise TypeError(
        f"{port.owner}.{port.name}: there is no sample of this type; give one in values={{{port.name!r}: ...}}"
    )


def odd(port: Input) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Unusual values for an input: a name, and a function that makes one or raises PortError itself."""
    components = 1
    ordinary = sample(port)
    first = ordinary[0] if port.many else ordinary
    if isinstance(first, data.Volume):
        components = first.components
    for type, name, make in _odd_values(components, getattr(first, "channels", 4)):
        if issubclass(type, port.type):
            yield name, partial(_alone, make) if port.many else make


def arguments(processor: type[Processor], folder: Path, values: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Inputs and parameters for an ordinary call: what is given, samples for inputs, files below ``folder``."""
    given = dict(values or {})
    for name, port in processor.inputs.items():
        if name not in given:
            given[name] = sample(port)
    for name, parameter in processor.params.items():
        if name in given:
            continue
        if isinstance(parameter, params.File):
            given[name] = _file(parameter, folder)
        elif isinstance(parameter, params.Folder):
            given[name] = str(folder)
        elif isinstance(parameter, params.Camera):
            given[name] = CAMERA
        elif isinstance(parameter, params.TransferFunction) and not parameter.default.keys:
            given[name] = TABLE
        elif isinstance(parameter, params.TransferFunction2D) and not parameter.default.areas:
            given[name] = AREAS
    return given


def another(parameter: Parameter) -> Any:
    """A legal value that is not the default.

    A kind of parameter that is not known here offers one itself, as a method ``another()``.
    """
    offered = getattr(parameter, "another", None)
    for value in [offered()] if offered else _others(parameter):
        try:
            checked = parameter.check(value, parameter.name)
        except ParameterError:
            continue
        if checked != parameter.default:
            return checked
    raise TypeError(
        f"{parameter.owner}.{parameter.name}: no second legal value is known; give {parameter.kind} another()"
    )


def made_visible(processor: type[Processor], name: str) -> dict[str, Any]:
    """Values of other parameters under which a parameter is visible."""
    values: dict[str, Any] = {}
    for other, allowed in processor.params[name].visible_if.items():
        values.update(made_visible(processor, other))
        if processor.params[other].default not in allowed:
            values[other] = allowed[0]
    return values


def _alone(make: Callable[[], Any]) -> tuple[Any]:
    return (make(),)


def _grid(*shape: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.random.default_rng(7).random(shape, np.float32)


def _volume(shape: tuple[int, ...], dtype: str = "f4", scale: float = 1.0) -> data.Volume:
    return data.Volume((_grid(*shape) * scale).astype(dtype), _WORLD)


def _image(channels: int, size: tuple[int, int] = SIZE, dtype: str = "f4") -> data.Image:
    width, height = size
    color = _grid(height, width, channels).astype(dtype)
    if channels == 4:
        color[..., :3] *= color[..., 3:]
    if channels == 2:  # entry and exit distances of rays that cross the sample grids, mm
        color = np.stack([15.0 + color[..., 0], 35.0 + color[..., 1]], axis=-1).astype(dtype)
    depth = 25.0 + _grid(height, width)
    ids = (4 * _grid(height, width)).astype("u4")
    return data.Image(color, depth, ids)


def _ordinary(type: type) -> Iterator[Any]:
    z, y, x = DIMS[::-1]
    candidates: list[Callable[[], Any]] = [
        *(partial(_volume, shape) for shape in ((z, y, x), (z, y, x, 3), (z, y, x, 4), (z, y, x, 2))),
        lambda: data.Labels((4 * _grid(z, y, x)).astype("u1"), _WORLD, {1: "one"}),
        *(partial(_image, channels) for channels in (4, 2, 1)),
        lambda: box(_volume((z, y, x)).corners),
        lambda: data.Table({"value": np.linspace(0.0, 1.0, 5), "count": np.arange(5)}),
        data.Camera,
        data.Light,
        data.Plane,
        lambda: TABLE,
        lambda: AREAS,
        lambda: 0.5,
        lambda: 2,
        lambda: True,
        lambda: "text",
        lambda: (0.0, 0.5, 1.0),
    ]
    for make in candidates:
        value = make()
        if isinstance(value, type):
            yield value


def _odd_values(components: int, channels: int) -> Iterator[tuple[type, str, Callable[[], Any]]]:
    tail = () if components == 1 else (components,)
    z, y, x = DIMS[::-1]

    def spoiled() -> data.Volume:
        array = _grid(z, y, x, *tail).copy()
        array[0, 0, 0], array[1, 2, 3], array[2, 2, 2] = np.nan, np.inf, -np.inf
        return data.Volume(array, _WORLD)

    def spoiled_picture() -> data.Image:
        color = _grid(SIZE[1], SIZE[0], channels).copy()
        color[0, 0], color[1, 1] = np.nan, np.inf
        return data.Image(color, np.full((SIZE[1], SIZE[0]), np.inf, "f4"))

    for dtype, scale in (("f8", 1e12), ("f2", 1.0), ("i2", 30000.0), ("u1", 255.0), ("i4", 1e9), ("u2", 65535.0)):
        yield data.Volume, f"volume of {dtype}", partial(_volume, (z, y, x, *tail), dtype, scale)
    yield data.Volume, "volume with nan and inf", spoiled
    yield data.Volume, "volume of nan alone", lambda: data.Volume(np.full((z, y, x, *tail), np.nan, "f4"), _WORLD)
    yield data.Volume, "constant volume", lambda: data.Volume(np.zeros((z, y, x, *tail), "f4"), _WORLD)
    yield data.Volume, "empty volume", lambda: data.Volume(np.zeros((0, y, x, *tail), "f4"))
    yield data.Volume, "one voxel", lambda: _volume((1, 1, 1, *tail))
    yield data.Volume, "one slice", lambda: _volume((1, y, x, *tail))
    yield data.Volume, "one row", lambda: _volume((1, 1, x, *tail))
    yield data.Volume, "turned and far away", lambda: data.Volume(_grid(z, y, x, *tail), _WORLD[[1, 2, 0, 3]] + _FAR)
    yield data.Labels, "labels of u4", lambda: data.Labels(np.full((z, y, x), 2**32 - 1, "u4"), _WORLD)
    yield data.Labels, "labels of i8", lambda: data.Labels(np.ones((z, y, x), "i8"), _WORLD)
    yield data.Labels, "one label", lambda: data.Labels(np.zeros((1, 1, 1), "u1"), _WORLD)
    yield data.Labels, "empty labels", lambda: data.Labels(np.zeros((z, 0, x), "u1"))
    yield data.Image, "picture of f8", lambda: _image(channels, dtype="f8")
    yield data.Image, "picture with nan and inf", spoiled_picture
    yield data.Image, "one pixel", lambda: _image(channels, (1, 1))
    yield data.Image, "picture of another size", lambda: _image(channels, (3, 11))
    yield data.Image, "picture without depth", lambda: data.Image(_grid(SIZE[1], SIZE[0], channels))
    yield data.Image, "empty picture", lambda: data.Image(np.zeros((0, 4, channels), "f4"))
    yield data.Mesh, "empty mesh", lambda: data.Mesh(np.zeros((0, 3)), np.zeros((0, 3), "i4"))
    yield data.Mesh, "flat triangle", lambda: data.Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    yield data.TransferFunction, "empty transfer function", data.TransferFunction
    yield data.TransferFunction2D, "empty 2-D transfer function", data.TransferFunction2D
    yield data.Table, "empty table", lambda: data.Table({"value": np.zeros(0)})
    yield float, "zero", lambda: 0.0


_FAR = np.array([[0.0, 0.0, 0.0, 1e6]] * 3 + [[0.0] * 4])


def _others(parameter: Parameter) -> Iterator[Any]:
    default: Any = parameter.default
    if isinstance(parameter, params.Bool):
        yield not default
    elif isinstance(parameter, params.Choice):
        yield from parameter.choices
    elif isinstance(parameter, (params.File, params.Folder)):
        yield f"{default}another"
    elif isinstance(parameter, params.Text):
        yield f"{default}x"
    elif isinstance(parameter, (params.Float, params.Int)):
        yield from _numbers(parameter, default)
    elif isinstance(parameter, params.Interval):
        low, high = default
        for number in _numbers(parameter, low):
            yield (number, high)
        for number in _numbers(parameter, high):
            yield (low, number)
    elif isinstance(parameter, (params.Vector, params.Color)):
        for place in range(len(default)):
            for number in _numbers(parameter, default[place]):
                yield (*default[:place], number, *default[place + 1 :])
    elif isinstance(parameter, params.Matrix):
        yield np.diag([2.0, 3.0, 4.0, 1.0])
        yield np.eye(4)
    elif isinstance(parameter, params.Box):
        yield ((-1.0, -2.0, -3.0), (1.0, 2.0, 3.0))
        yield None
    elif isinstance(parameter, params.Camera):
        yield data.Camera(eye=(0.0, 0.0, 500.0), up=(0.0, 1.0, 0.0))
    elif isinstance(parameter, params.Light):
        yield data.Light(intensity=0.25)
    elif isinstance(parameter, params.Plane):
        yield data.Plane((1.0, 2.0, 3.0), (1.0, 0.0, 0.0))
    elif isinstance(parameter, params.TransferFunction):
        yield data.TransferFunction([(0.25, (0.0, 0.0, 1.0), 0.1), (0.75, (1.0, 0.0, 0.0), 0.9)])
    elif isinstance(parameter, params.TransferFunction2D):
        yield data.TransferFunction2D([data.Gaussian((0.5, 0.1), (0.2, 0.1), (0.0, 0.0, 1.0), 0.9)])


def _numbers(parameter: Parameter, start: float) -> Iterator[float]:
    """Numbers near ``start`` and then the ends of the range."""
    for shift in (0.25, -0.25, 1, -1):
        yield start + shift
    if isinstance(parameter, params.Bounded):
        yield from (end for end in (parameter.min, parameter.max) if end is not None)


def _file(parameter: params.File, folder: Path) -> str:
    """A path to write to, or a small NumPy file to read where the parameter takes one, else ""."""
    if parameter.write:
        return str(folder / f"written{parameter.suffixes[0] if parameter.suffixes else '.out'}")
    if ".npy" not in parameter.suffixes:
        return str(parameter.default)
    path = folder / "sample.npy"
    if not path.exists():
        np.save(path, _grid(*DIMS[::-1]))
    return str(path)
