"""Running kernels: bindings by name, outputs, and what is said when something does not fit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph.data import TransferFunction, Volume
from nodegraph.data.buffer import Buffer
from nodegraph.errors import Cancelled, DeviceError, ParameterError, ShaderError
from nodegraph.shaders import Source

UNIFORMS = Source.of(
    """
struct Lamp { vec3 direction; float power; };
struct Eye { mat4 view; vec2 size; bool on; };
uniform float f;
uniform int i;
uniform uint u;
uniform bool b;
uniform vec2 v2;
uniform vec3 v3;
uniform vec4 v4;
uniform ivec3 iv;
uniform uvec2 uv;
uniform mat3 m3;
uniform float list[3];
uniform vec4 planes[2];
uniform Eye eye;
uniform Lamp lamps[2];
uniform float gain = 2.0;
struct Out { vec4 a; vec4 b; vec4 c; int i; uint u; vec2 d; };
Out pixel(ivec2 at) {
    Out o;
    o.a = vec4(f, v2.y, v3.z, v4.w);
    o.b = vec4(transform(m3, vec3(1.0, 10.0, 100.0)), list[0] + 10.0 * list[1] + 100.0 * list[2]);
    o.c = transform(eye.view, vec4(1.0, 10.0, 100.0, 1000.0)) + planes[0] * 0.5 + planes[1];
    o.i = i + iv.x * 10 + iv.y * 100 + iv.z * 1000;
    o.u = u + uv.y;
    o.d = vec2(lamps[1].direction.y * lamps[0].power * gain, b && eye.on ? eye.size.x : -1.0);
    return o;
}
""",
    "tests/uniforms.glsl",
)
GAIN = Source.of(
    "uniform float gain;\nfloat pixel(ivec2 at) { return gain * float(at.x + 100 * at.y); }", "tests/gain.glsl"
)
RAMP = Source.of("float voxel(ivec3 at) { return float(at.x + 100 * at.y + 10000 * at.z); }", "tests/ramp.glsl")
TWICE = Source.of("field3 v;\nfloat voxel(ivec3 at) { return 2.0 * fetch3(v, at); }", "tests/twice.glsl")


class Camera:
    """Any object whose attributes bear the names of the struct's members."""

    view = np.arange(16.0).reshape(4, 4)
    size = (3.0, 4.0)
    on = True


def everything() -> dict[str, Any]:
    return {
        "f": 1.5, "i": -7, "u": 2**32 - 100, "b": True, "v2": (1.0, 2.0), "v3": np.array([1, 2, 3]), "v4": [1, 2, 3, 4],
        "iv": (1, -2, 3), "uv": (5, 60), "m3": np.arange(9.0).reshape(3, 3), "list": [1.0, 2.0, 3.0],
        "planes": np.arange(8.0).reshape(2, 4), "eye": Camera(),
        "lamps": [{"direction": (0, 1, 0), "power": 3.0}, {"direction": (0, 5, 0), "power": 4.0}],
    }  # fmt: skip


def test_uniforms_of_every_type(device: Any) -> None:
    out = device.run(UNIFORMS, (2, 1), **everything())
    assert out._fields == ("a", "b", "c", "i", "u", "d")
    assert out.a.array[0, 1].tolist() == [1.5, 2.0, 3.0, 4.0]
    m3 = np.arange(9.0).reshape(3, 3) @ [1.0, 10.0, 100.0]
    assert out.b.array[0, 0].tolist() == [*m3, 321.0]
    assert (
        out.c.array[0, 0].tolist() == (Camera.view @ [1, 10, 100, 1000] + np.arange(4) * 0.5 + np.arange(4, 8)).tolist()
    )
    assert out.i.array[0, 0] == -7 + 10 - 200 + 3000
    assert out.u.array[0, 0] == 2**32 - 40
    assert out.d.array[0, 0].tolist() == [5.0 * 3.0 * 2.0, 3.0]
    assert [b.dtype.name for b in out[:5]] == [device.real.name] * 3 + ["int32", "uint32"]
    assert out.a.shape == (1, 2, 4)
    assert out.i.shape == (1, 2)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("f", "x", r"tests/uniforms.f: expected a number, got 'x'"),
        ("f", [1.0, 2.0], r"tests/uniforms.f: expected a number, got \[1.0, 2.0\]"),
        ("f", True, r"tests/uniforms.f: expected a number, got True"),
        ("f", None, r"tests/uniforms.f: None was bound"),
        ("i", 1.5, r"tests/uniforms.i: expected an int, got 1.5"),
        ("i", 2**31, r"tests/uniforms.i: expected an int, got 2147483648"),
        ("u", -1, r"tests/uniforms.u: expected an int from 0, got -1"),
        ("b", 0.5, r"tests/uniforms.b: expected a bool, got 0.5"),
        ("v3", (1.0, 2.0), r"tests/uniforms.v3: expected vec3 \(3 floats\), got \(1.0, 2.0\)"),
        ("iv", (1.0, 2.0, 3.0), r"tests/uniforms.iv: expected ivec3 \(3 ints\)"),
        ("m3", np.eye(4), r"tests/uniforms.m3: expected mat3 \(3x3 numbers, rows first\), got an array \(4, 4\)"),
        ("planes", np.zeros((3, 4)), r"tests/uniforms.planes: expected 2 times vec4 \(4 floats\)"),
        ("eye", {"view": np.eye(4), "sise": (1, 2), "on": True}, r"tests/uniforms.eye.size: .*did you mean 'sise'"),
        ("lamps", [{"direction": (0, 1, 0), "power": 1.0}], r"tests/uniforms.lamps: expected 2 values of Lamp, got 1"),
    ],
)
def test_a_value_that_does_not_fit_names_uniform_and_type(device: Any, name: str, value: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{message}"):
        device.run(UNIFORMS, (2, 1), **{**everything(), name: value})


def test_reals_beyond_single_precision_are_refused_where_it_is_the_precision(device: Any) -> None:
    if device.name == "cl64":
        assert device.run(GAIN, (2, 1), gain=1e300).array[0, 1] == 1e300
    else:
        with pytest.raises(ParameterError, match=r"^tests/gain.gain: 1e\+300 is beyond single precision"):
            device.run(GAIN, (2, 1), gain=1e300)
    assert device.run(GAIN, (2, 1), gain=np.inf).array[0, 1] == np.inf


def test_unset_and_unknown_names_are_refused_with_the_near_miss(device: Any) -> None:
    with pytest.raises(ParameterError, match=r"^tests/gain.gian: .*no such uniform or field \(did you mean 'gain'\?\)"):
        device.run(GAIN, (2, 2), gian=1.0)
    with pytest.raises(ParameterError, match=r"^tests/gain.gain: the kernel reads it and nothing is bound to it"):
        device.run(GAIN, (2, 2))
    with pytest.raises(
        ParameterError, match=r"^tests/twice.v: expected a scalar Volume, a Buffer or an array, got float"
    ):
        device.run(TWICE, (2, 2, 2), v=1.0)


@pytest.mark.parametrize("size", [(0, 4), (4, -1), (4,), (4, 4, 4), (4.5, 4), None, "ab"])
def test_sizes_that_make_no_sense_are_refused(device: Any, size: Any) -> None:
    with pytest.raises(ParameterError, match=r"^tests/gain.size: expected \(w, h\) pixels, each at least 1"):
        device.run(GAIN, size, gain=1.0)


@pytest.mark.parametrize("size", [(1, 1), (67, 35), (128, 1), (1, 130)])
def test_every_pixel_once_row_0_on_top(device: Any, size: tuple[int, int]) -> None:
    got = device.run(GAIN, size, gain=1.0)
    y, x = np.mgrid[: size[1], : size[0]]
    assert got.shape == size[::-1]
    assert (got.array == x + 100 * y).all()


@pytest.mark.parametrize("size", [(1, 1, 1), (67, 3, 5), (1, 9, 2), (2, 1, 11)])
def test_every_voxel_once(device: Any, size: tuple[int, int, int]) -> None:
    got = device.run(RAMP, size)
    z, y, x = np.mgrid[: size[2], : size[1], : size[0]]
    assert (got.array == x + 100 * y + 10000 * z).all()


def test_results_feed_the_next_run_without_leaving_the_device(device: Any) -> None:
    ramp = device.run(RAMP, (5, 4, 3))
    twice = device.run(TWICE, (5, 4, 3), v=ramp)
    four = device.run(TWICE, (5, 4, 3), v=Volume(twice, mapping=(1.0, 1.0, "")))
    assert not ramp.on_host
    assert not twice.on_host
    assert (four.array == 4 * ramp.array + 2).all()


def test_images_and_tables_are_fields(device: Any) -> None:
    source = Source.of(
        """
field2 image;
field1 table;
field2u ids;
uniform float at_x;
vec4 pixel(ivec2 at) {
    return sample1(table, at_x) + sample2(image, vec2(0.5, 1.0)) + vec4(float(fetch2u(ids, ivec2(0, 1)) - 16777216u));
}
""",
        "tests/table.glsl",
    )
    function = TransferFunction([(0.0, (0, 0, 0), 0.0), (1023.0, (1, 1, 1), 0.0)])
    image = np.zeros((2, 2, 2), np.float32)
    image[1] = [[2.0, 4.0], [4.0, 8.0]]
    ids = np.array([[0, 0], [16777217, 0]], np.uint32)
    got = device.run(source, (1, 1), image=image, table=function, ids=ids, at_x=511.5).array[0, 0]
    assert got == pytest.approx([0.5 + 3.0 + 1.0, 0.5 + 6.0 + 1.0, 0.5 + 1.0, 1.0], rel=1e-6)


def test_field_arrays_mix_types(device: Any) -> None:
    source = Source.of(
        """
field3 v[N];
float voxel(ivec3 at) {
    float s = 0.0;
    for (int i = 0; i < N; i++) s += fetch3(v[i], at);
    return s;
}
""",
        "tests/many.glsl",
    )
    volumes = [np.full((2, 2, 2), -5, np.int16), np.full((2, 2, 2), 0.25, np.float32)]
    got = device.run(source, (2, 2, 2), defines={"N": 2}, v=volumes).array
    assert got == pytest.approx(-4.75)
    with pytest.raises(ParameterError, match=r"^tests/many.v: expected a sequence of 2 volumes, got 1 values"):
        device.run(source, (2, 2, 2), defines={"N": 2}, v=volumes[:1])


def test_kernels_are_found_by_name_and_read_again_when_they_change(device: Any, tmp_path: Path) -> None:
    folder = tmp_path / "demo"
    folder.mkdir()
    file = folder / "one.glsl"
    file.write_text("float pixel(ivec2 at) { return 1.0; }")
    device.roots.insert(0, tmp_path)
    try:
        assert device.run("demo/one", (1, 1)).array[0, 0] == 1.0
        file.write_text("float pixel(ivec2 at) { return 22.0; }")
        assert device.run("demo/one", (1, 1)).array[0, 0] == 22.0
        with pytest.raises(ShaderError, match="demo/oen"):
            device.run("demo/oen", (1, 1))
    finally:
        device.roots.pop(0)


def test_names_of_run_itself_cannot_be_uniforms(device: Any) -> None:
    source = Source.of("uniform vec2 size;\nfloat pixel(ivec2 at) { return size.x; }", "tests/size.glsl")
    with pytest.raises(ParameterError, match=r"^tests/size.size: this name belongs to an argument of run"):
        device.run(source, (1, 1))


def test_cancel_between_strips_leaves_nothing(device: Any) -> None:
    device.run(GAIN, (64, 64), gain=1.0)
    device.memory.drain()
    before = device.memory.objects

    def check() -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        device.run(GAIN, (64, 64), gain=1.0, check=check)
    device.memory.drain()
    assert device.memory.objects == before


def test_progress_ends_at_one(device: Any) -> None:
    seen: list[float] = []
    device.run(GAIN, (300, 300), gain=1.0, progress=seen.append)
    assert seen[-1] == 1.0
    assert seen == sorted(seen)


def test_a_driver_error_points_at_the_authors_line(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source.of("float pixel(ivec2 at) {\n    return 1.0;\n}\n// driver_only", "tests/broken.glsl")
    original = type(device).print

    def broken(self: Any, module: Any, storages: Any) -> Any:
        text, layout = original(self, module, storages)
        return text.replace("return", "return no_such_name +"), layout

    monkeypatch.setattr(type(device), "print", broken)
    with pytest.raises(ShaderError, match="no_such_name") as caught:
        device.run(source, (1, 1))
    assert (caught.value.file, caught.value.line) == ("tests/broken.glsl", 2)
    assert "return 1.0;" in caught.value.excerpt


def test_other_threads_are_refused(device: Any) -> None:
    import threading

    caught: list[BaseException] = []

    def work() -> None:
        try:
            device.run(GAIN, (2, 2), gain=1.0)
        except DeviceError as error:
            caught.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert "runs only on the thread that opened it" in str(caught[0])


def test_buffers_and_arrays_give_the_same(device: Any, rng: np.random.Generator) -> None:
    data = rng.integers(-100, 100, (3, 4, 5)).astype(np.int16)
    one = device.run(TWICE, (5, 4, 3), v=data).array
    assert (one == device.run(TWICE, (5, 4, 3), v=Buffer(data)).array).all()
    assert (one == device.run(TWICE, (5, 4, 3), v=Volume(data)).array).all()


def test_what_lies_outside_a_box_is_kept_also_by_a_kernel_that_never_ran(device: Any) -> None:
    first, second = (
        Source.of(f"uniform float g;\nfloat pixel(ivec2 at) {{ return {n} * g; }}", f"tests/box_{n}.glsl")
        for n in ("1.0", "2.0")
    )
    kept = device.run(first, (64, 64), g=5.0)
    found = device.run(second, (64, 64), g=9.0, into=(kept,), box=(32, 32, 64, 64)).array
    assert np.all(found[32:, 32:] == 18.0)
    assert np.all(found[:32] == 5.0)
    assert np.all(found[:, :32] == 5.0)
    same = device.run(first, (64, 64), g=5.0)
    assert np.all(device.run(second, (64, 64), g=9.0, into=(same,), box=(32, 32, 32, 64)).array == 5.0)
