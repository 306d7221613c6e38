"""Every shipped kernel in every variant that its processor can ask for: the same result on each device.

On colours in 0..1: the 99.9 percentile of the greatest difference of a pixel is at most 2e-3, the mean at most 2e-5, at
most 0.1 % of the pixels lie beyond 2e-3. Hit or miss may differ within a pixel of a silhouette. Other numbers are
compared relative to the greatest. OpenCL in double is the reference; both single-precision devices are held against it
and against each other.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from nodegraph import locations
from nodegraph.compute import language
from nodegraph.data import (
    Camera,
    Gaussian,
    Image,
    Light,
    Mapping,
    Plane,
    TransferFunction,
    TransferFunction2D,
    Trapezoid,
    Volume,
)
from nodegraph.data.space import centred
from nodegraph.shaders import load
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (96, 80)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=24.0)
FUNCTION = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.0), (0.3, (0.9, 0.3, 0.1), 0.05), (1.0, (0.9, 0.8, 0.6), 0.4)])


def _field(dtype: str = "f4", seed: int = 5) -> Volume:
    """Smooth noise about a ball, 18 x 20 x 22 voxels, turned and anisotropic."""
    random = np.random.default_rng(seed)
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (18, 20, 22)), indexing="ij")
    data = np.exp(-3 * (x * x + y * y + z * z)) * (0.8 + 0.2 * random.random(x.shape))
    matrix = centred((22, 20, 18), (2.0, 2.2, 2.6))
    c, s = np.cos(0.3), np.sin(0.3)
    matrix = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]) @ matrix
    return Volume((data * 200).astype(dtype) if dtype != "f4" else data.astype("f4"), matrix)


def _pictures(seed: int) -> tuple[Image, Image]:
    random = np.random.default_rng(seed)
    made = []
    for _ in range(2):
        alpha = random.random((SIZE[1], SIZE[0], 1))
        color = np.concatenate([random.random((SIZE[1], SIZE[0], 3)) * alpha, alpha], 2).astype("f4")
        depth = (400 + 60 * random.random((SIZE[1], SIZE[0]))).astype("f4")
        depth[random.random(depth.shape) < 0.2] = np.inf
        made.append(Image(color, depth))
    return made[0], made[1]


VOLUME = _field()
STORED = Volume((VOLUME.data * 30000).astype("i2"), np.asarray(VOLUME.index_to_world), Mapping(1 / 30000, 0.0, ""))
GRADIENT = Volume(np.random.default_rng(7).normal(size=(18, 20, 22, 4)).astype("f4"), np.asarray(VOLUME.index_to_world))
SLOPES = Volume(GRADIENT.data * np.float32(0.02), np.asarray(VOLUME.index_to_world))
FRONT, BACK = _pictures(11)
_box = call("geometry.proxy_box", volume=VOLUME, crop=((0.1, 0.1, 0.1), (0.9, 0.8, 0.95)))
INTERVAL = Image(np.tile(np.float32([120.0, 175.0]), (SIZE[1], SIZE[0], 1)))


def _raycasts() -> list[tuple[str, dict[str, Any]]]:
    cases = []
    for mode, light, normals, inner, early in itertools.product(
        ("composite", "maximum", "first_hit", "iso"), (None, "directional", "point"), (0, 1), (0, 1), (0, 1)
    ):
        if (normals and light is None) or (early and mode != "composite") or (light and mode == "maximum"):
            continue
        values: dict[str, Any] = {
            "volume": STORED if early else VOLUME, "camera": CAMERA, "transfer_function": FUNCTION, "mode": mode,
            "lit": light is not None,
            "iso_value": 0.4, "hit_extinction": 0.1, "termination": 0.8 if early else 1.0,
        }  # fmt: skip
        if light:
            values["light"] = Light(light, "world" if light == "point" else "eye", (40.0, -90.0, 70.0))
        values |= {"gradient": GRADIENT} if normals else {}
        values |= {"interval": INTERVAL} if inner else {}
        name = "-".join(
            [mode, light or "unlit", *["gradient"] * normals, *["interval"] * inner, *["termination"] * early]
        )
        cases.append((name, values))
    return cases


SPARSE = TransferFunction([(0.6, (0.9, 0.3, 0.1), 0.0), (0.7, (0.9, 0.3, 0.1), 0.2), (0.8, (0.9, 0.8, 0.6), 0.0)])


KEYED = TransferFunction([(i / 6, (0.9, 0.3, 0.1), 0.1 * (i % 3)) for i in range(7)])


def _integrators() -> list[tuple[str, dict[str, Any]]]:
    """Each way to integrate twice: with what makes it dear, and with what makes it cheap."""
    cases = []
    for integrator in ("trapezoid", "preintegrated", "gauss2", "gauss3", "cellwise", "adaptive"):
        both = {"camera": CAMERA, "integrator": integrator}
        dear = {"volume": VOLUME, "transfer_function": FUNCTION, "termination": 1.0, "order": 2, "gradient": GRADIENT}
        cheap = {"volume": STORED, "transfer_function": SPARSE, "termination": 0.9, "interval": INTERVAL, "lit": False}
        cases += [(f"{integrator}-dear", both | dear), (f"{integrator}-cheap", both | cheap)]
        lit = {"volume": VOLUME, "transfer_function": FUNCTION, "termination": 1.0, "order": 3}
        cases += [(f"{integrator}-lit", both | lit), (f"{integrator}-matte", both | lit | {"specular": 0.0})]
        cases += [(f"{integrator}-precomputed", both | lit | {"gradients": "precomputed"})]
    many = {"volume": VOLUME, "transfer_function": KEYED, "integrator": "adaptive", "camera": CAMERA, "lit": False}
    cases += [("adaptive-many-keys", many)]
    phases = {"volume": VOLUME, "transfer_function": SPARSE, "camera": CAMERA, "quality": "interactive/2"}
    cases += [("interactive", phases), ("interactive-gauss2", phases | {"integrator": "gauss2", "lit": False})]
    for mode in ("composite", "maximum", "first_hit", "iso"):
        values = {"volume": VOLUME, "transfer_function": SPARSE, "mode": mode, "termination": 1.0, "lit": False}
        values |= {"camera": CAMERA, "iso_value": 0.75, "hit_extinction": 0.1}
        matte = {"lit": True, "specular": 0.0, "gradients": "precomputed"} if mode != "maximum" else {}
        cases += [(f"{mode}-sparse", values), (f"{mode}-matte", values | matte)]
        cases += [(f"{mode}-sparse-all", values | {"skip": False, "volume": STORED})]
    return cases


AREAS = TransferFunction2D(
    [
        Trapezoid((0.1, 0.3), (0.05, 0.7), (0.0, 0.04), 0.5, (0.1, 0.2, 0.9), 0.1),
        Gaussian((0.6, 0.03), (0.15, 0.02), (0.9, 0.8, 0.6), 0.4),
    ]
)


def _by_gradient() -> list[tuple[str, dict[str, Any]]]:
    """Value and gradient magnitude: each integrator lit and not, with gradients wired and not, sparse and dense."""
    seen = {"volume": VOLUME, "camera": CAMERA, "transfer_function": AREAS, "termination": 1.0}
    far = TransferFunction2D([Gaussian((0.8, 0.02), (0.03, 0.02), (0.9, 0.3, 0.1), 0.5)])
    lamp = {"light": Light("point", "world", (40.0, -90.0, 70.0))}
    cases = [(f"{one}-lit", seen | lamp | {"integrator": one}) for one in ("midpoint", "gauss2", "gauss3")]
    cases += [(f"{one}-unlit", seen | {"integrator": one, "lit": False}) for one in ("midpoint", "gauss3")]
    exact = {"integrator": "cellwise", "order": 2}
    cases += [("cellwise-lit", seen | lamp | exact), ("adaptive-lit", seen | lamp | {"integrator": "adaptive"})]
    cases += [("cellwise-matte", seen | {"integrator": "cellwise", "specular": 0.0, "gradients": "precomputed"})]
    cases += [("adaptive-matte", seen | {"integrator": "adaptive", "specular": 0.0, "gradients": "precomputed"})]
    for one in ("trapezoid", "preintegrated", "cellwise", "adaptive"):
        cheap = {"volume": STORED, "gradient": SLOPES, "interval": INTERVAL, "lit": False, "transfer_function": far}
        cases += [(f"{one}-cheap", seen | cheap | {"integrator": one, "termination": 0.8})]
    cases += [(f"{one}-dense", seen | {"integrator": one, "skip": False}) for one in ("cellwise", "adaptive")]
    cases += [("wired", seen | {"gradient": SLOPES}), ("interval", seen | {"interval": INTERVAL, "skip": False})]
    cases += [("dense", seen | {"skip": False, "volume": STORED}), ("early", seen | {"termination": 0.8})]
    cases += [("matte", seen | {"specular": 0.0})]
    cases += [("precomputed", seen | {"gradients": "precomputed"}), ("sparse", seen | {"transfer_function": far})]
    return cases


CASES: list[tuple[str, str, dict[str, Any]]] = [
    *(("render.raycast", name, values) for name, values in _raycasts() + _integrators()),
    *(("render.raycast_2d", name, values) for name, values in _by_gradient()),
    ("render.raycast", "orthographic", {
        "volume": VOLUME, "camera": CAMERA.with_(projection="orthographic", height=60.0), "termination": 1.0,
        "transfer_function": FUNCTION}),
    *(("render.slice", f"{look}-{kind}", {
        "volume": STORED if kind == "nearest" else VOLUME, "coloring": look, "interpolation": kind,
        "transfer_function": FUNCTION, "plane": Plane((1.0, 2.0, 3.0), (0.3, -0.8, 0.5))})
        for look in ("window", "transfer_function") for kind in ("linear", "nearest")),
    ("render.slice", "interactive", {"volume": VOLUME, "plane": Plane(), "quality": "interactive/4"}),
    *(("render.entry_exit_points", camera.projection, {"geometry": _box, "camera": camera})
        for camera in (CAMERA, CAMERA.with_(projection="orthographic", height=60.0))),
    ("render.entry_exit_points", "front", {"geometry": _box, "camera": CAMERA, "front": FRONT}),
    *(("filter.gradient", f"{method}-{dtype}", {"volume": _field(dtype), "method": method})
        for method in ("central", "forward", "sobel") for dtype in ("f4", "i2", "u1")),
    *(("image.background", pattern, {"image": FRONT, "pattern": pattern, "second_color": (0.9, 0.1, 0.4)})
        for pattern in ("solid", "vertical", "radial")),
    *(("image.compose", mode, {"front": FRONT, "back": BACK, "mode": mode, "weight": 0.3})
        for mode in ("over", "nearest", "add", "multiply", "mix")),
    ("image.depth_darkening", "both-passes", {"image": FRONT, "sigma": 5.0}),
    ("image.difference", "amplified", {"image": FRONT, "reference": BACK, "gain": 1.0}),
    *(("image.ssao", f"{method}-{sampling}", {"image": FRONT, "camera": CAMERA, "method": method, "sampling": sampling})
        for method in ("hemisphere", "sphere") for sampling in ("hashed", "every_pixel")),
]  # fmt: skip


class Recorder:
    """Stands before a device and notes which variants were asked for."""

    def __init__(self, device: Any, asked: set[tuple[str, tuple[tuple[str, int], ...]]]) -> None:
        self.device = device
        self.asked = asked

    def __getattr__(self, name: str) -> Any:
        return getattr(self.device, name)

    def run(self, kernel: str, size: Any, *, defines: Any = None, **rest: Any) -> Any:
        self.asked.add((kernel, tuple(sorted((name, int(value)) for name, value in (defines or {}).items()))))
        return self.device.run(kernel, size, defines=defines, **rest)


ASKED: set[tuple[str, tuple[tuple[str, int], ...]]] = set()


def _arrays(result: Any) -> list[np.ndarray]:
    """Colour, then depth; the data of a volume."""
    result = getattr(result, "difference", getattr(result, "shaded", result))
    if isinstance(result, Volume):
        return [result.data]
    return [result.color] if result.depth is None else [result.color, result.depth]


def _same(name: str, one: np.ndarray, other: np.ndarray) -> None:
    assert one.shape == other.shape
    seen, wanted = np.isfinite(one), np.isfinite(other)
    assert np.mean(seen != wanted) <= 1e-3, f"{name}: hit or miss"
    both = seen & wanted
    error = np.where(both, np.abs(np.where(both, one, 0.0) - np.where(both, other, 0.0)), 0.0)
    error /= max(1.0, float(np.abs(other[both]).max(initial=0.0)))
    worst = error.reshape(*error.shape[:2], -1).max(axis=-1)
    assert np.percentile(worst, 99.9) <= 2e-3, name
    assert error.mean() <= 2e-5, name
    assert np.mean(worst > 2e-3) <= 1e-3, name


@pytest.mark.parametrize(("id", "name", "values"), CASES, ids=[f"{id}-{name}" for id, name, _ in CASES])
def test_devices_agree(gl: Any, cl: Any, cl64: Any, id: str, name: str, values: dict[str, Any]) -> None:
    on_gl, on_cl, exact = (
        _arrays(call(id, Recorder(device, ASKED), SIZE, **values)) for device in (gl, cl, cl64)
    )  # fmt: skip
    assert np.ptp(exact[0]) > 0.1, "the case shows nothing"
    for pair, left, right in (("gl, cl", on_gl, on_cl), ("gl, cl64", on_gl, exact), ("cl, cl64", on_cl, exact)):
        for part, (one, other) in enumerate(zip(left, right, strict=True)):
            _same(f"{pair}, part {part}", one, other)


def test_every_variant_is_among_the_cases(gl: Any) -> None:
    """A kernel or a feature that is added to shaders/ must be added here: found by the defaults of its defines."""
    for id, _, values in CASES:
        call(id, Recorder(gl, ASKED), SIZE, **values)
    roots = [locations.shaders()]
    kernels = {
        str(path.relative_to(roots[0]).with_suffix("")).replace("\\", "/")
        for path in locations.shaders().rglob("*.glsl")
        if path.parent.name != "common"
    }
    # Sparse pictures, and volumes in blocks, have tests of their own beside the ray-caster's.
    kernels -= {"render/sparse"}
    assert {kernel for kernel, _ in ASKED} == kernels
    for kernel in kernels:
        asked = [dict(defines) for name, defines in ASKED if name == kernel]
        text = load(kernel, roots)
        declared = {line.split()[1] for line in text.lines if line.startswith("#define ") and len(line.split()) > 2}
        elsewhere = {"SPARSE", "CARRIED", "SEARCHES_ALL"}
        declared = {name for name in declared - elsewhere if f"#ifndef {name}" in text.lines}
        for name in declared:
            assert len({defines.get(name) for defines in asked}) > 1, f"{kernel}: {name} never changes"
        for defines in asked:
            assert language.compile(text, defines).entry in ("pixel", "voxel")
