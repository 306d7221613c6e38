"""Processors that are one kernel file: what is read from it, what is refused, and that it runs on every device."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph import data, glsl_processor, locations, params, shaders
from nodegraph.errors import ShaderError, UnknownProcessor
from nodegraph.registry import Registry

GAIN = """\
// Brighten a picture.
//
// Alpha and depth stay as they are.
// Version: 3
// Formerly: image.brighter, image.gain2
field2 image;                // Picture.
uniform float gain = 2.0;    // 0..10; Factor.

vec4 pixel(ivec2 at) {
    vec4 color = fetch2(image, at);
    return vec4(gain * color.rgb, color.a);
}
"""

OPACITY = """\
/* Opacity of a volume by a transfer function.
 */
field3 volume;          // Scalar field.
field1 table;           // Colour and extinction.
uniform vec2 table_lookup;
uniform vec3 volume_spacing;
uniform int power = 1;  // 1..8; Exponent.

float voxel(ivec3 at) {
    float row = fetch3(volume, at) * table_lookup.x + table_lookup.y;
    return pow(sample1(table, row).a * volume_spacing.z, float(power));
}
"""

RAMP = """\
// A ramp over the picture, with depth.
uniform ivec2 result_size;
uniform vec4 left_color;    // Colour at the left edge.
uniform bool flip = true;   // Right to left.

struct Result { vec4 color; float depth; };

Result pixel(ivec2 at) {
    float x = float(at.x) / float(result_size.x);
    Result result;
    result.color = left_color * (flip ? x : 1.0 - x);
    result.depth = x;
    return result;
}
"""

DOUBLE = """\
// Ids doubled, and where they are.
field3u ids;   // Ids.

struct Result { uint twice; float there; };

Result voxel(ivec3 at) {
    Result result;
    result.twice = 2u * fetch3u(ids, at);
    result.there = result.twice > 0u ? 1.0 : 0.0;
    return result;
}
"""


def make(tmp_path: Path, text: str, name: str = "image/gain") -> Any:
    path = tmp_path / f"{name}.glsl"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return Registry([locations.plugin_folder(tmp_path, "test")]).find(name.replace("/", "."))


class OneDevice:
    """Runs the kernels of one processor, as the engine's facade does."""

    def __init__(self, device: Any, processor: Any) -> None:
        self.device, self.processor = device, processor

    def run(self, kernel: str, size: Any, **bindings: Any) -> Any:
        return self.device.run(shaders.load(kernel, self.processor.shader_roots), size, **bindings)


def test_declarations_come_from_the_file(tmp_path: Path) -> None:
    gain = make(tmp_path, GAIN)
    assert (gain.__name__, gain.id, gain.version) == ("Gain", "image.gain", 3)
    assert gain.formerly == ("image.brighter", "image.gain2")
    assert gain.__doc__ == "Brighten a picture.\n\nAlpha and depth stay as they are."
    assert make(tmp_path, "// plugins/image/gain.glsl\n" + GAIN).__doc__ == gain.__doc__
    assert gain.inputs["image"].type is data.Image
    assert gain.outputs["result"].type is data.Image
    assert gain.params["gain"].describe() == {
        "kind": "Float", "default": 2.0, "doc": "Factor.", "min": 0.0, "max": 10.0,
    }  # fmt: skip
    assert gain.services == ("device",)
    assert gain.kernels == ("image/gain",)
    assert gain.file.endswith("gain.glsl")


def test_an_old_name_in_the_header_finds_it(tmp_path: Path) -> None:
    make(tmp_path, GAIN)
    found = Registry([locations.plugin_folder(tmp_path, "test")])
    assert found.find("image.brighter").id == "image.gain"


def test_uniforms_become_parameters_by_type(tmp_path: Path) -> None:
    text = """\
// Every type.
uniform float a;                              // 0.5..4 mm; A.
uniform float b = -1.5e-1;                    // ..1; B.
uniform int c = 3;                            // 0..; C.
uniform uint d = 4u;                          // D.
uniform bool e = true;                        // E.
uniform vec2 f = vec2(1.0, 2.0);              // -5..5; F.
uniform vec3 g = vec3(0.5);                   // G: not a range; 1..2.
uniform ivec3 h = ivec3(1, 2, 3);             // 1..64 voxel; H.
uniform vec3 sky_color = vec3(1.0, 0.5, 0.0); // I.
uniform vec4 color;                           // J.
uniform mat4 k;                               // K.
vec4 pixel(ivec2 at) { return color; }
"""
    made = make(tmp_path, text).params
    kinds = {name: parameter.kind for name, parameter in made.items()}
    assert kinds == {
        "a": "Float", "b": "Float", "c": "Int", "d": "Int", "e": "Bool", "f": "Vector", "g": "Vector", "h": "Vector",
        "sky_color": "Color", "color": "Color", "k": "Matrix",
    }  # fmt: skip
    assert (made["a"].default, made["a"].min, made["a"].max, made["a"].unit) == (0.5, 0.5, 4.0, "mm")
    assert (made["b"].default, made["b"].min, made["b"].max) == (-0.15, None, 1.0)
    assert (made["c"].default, made["c"].min, made["c"].max) == (3, 0, None)
    assert (made["d"].default, made["d"].min) == (4, 0)
    assert made["e"].default is True
    assert (made["f"].default, made["f"].min) == ((1.0, 2.0), -5.0)
    assert (made["g"].default, made["g"].doc) == ((0.5, 0.5, 0.5), "G: not a range; 1..2.")
    assert (made["h"].default, made["h"].unit) == ((1, 2, 3), "voxel")
    assert made["sky_color"].default == (1.0, 0.5, 0.0)
    assert made["color"].default == (1.0, 1.0, 1.0, 1.0)


def test_fields_become_ports(tmp_path: Path) -> None:
    text = """\
// Every field.
field3 a;   // A.
field3v b;  // B.
field3u c;  // C.
field2 d;   // D.
field2u e;  // E.
field1 f;   // F.
float voxel(ivec3 at) { return 0.0; }
"""
    made = make(tmp_path, text)
    assert {name: port.type.__name__ for name, port in made.inputs.items()} == {
        "a": "Volume", "b": "Volume", "c": "Labels", "d": "Image", "e": "Image",
    }  # fmt: skip
    assert isinstance(made.params["f"], params.TransferFunction)
    assert made.outputs["result"].type is data.Volume


def test_a_camera_is_a_parameter_and_size_a_service(tmp_path: Path) -> None:
    text = """\
// Directions of rays.
#include "common/camera.glsl"
uniform Camera camera;  // The eye.
vec4 pixel(ivec2 at) { return vec4(cast_ray(camera, at).direction, 1.0); }
"""
    made = make(tmp_path, text)
    assert isinstance(made.params["camera"], params.Camera)
    assert made.services == ("size", "device")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("// A.\nfield3 v;\nfloat voxel(ivec3 at) { return 0.0; }", r"image/gain.glsl:2: v: say what it is"),
        ("// A.\nuniform float a, b; // Two.\nvec4 pixel(ivec2 at) {}", r":2: write one declaration on a line"),
        ("// A.\nuniform float a[3]; // A.\nvec4 pixel(ivec2 at) {}", r":2: arrays cannot be"),
        ("// A.\nuniform Light light; // L.\nvec4 pixel(ivec2 at) {}", r":2: a uniform Light cannot be a parameter"),
        ("// A.\nuniform float a = PI; // A.\nvec4 pixel(ivec2 at) {}", r":2: a: the default must be numbers"),
        ("// A.\nuniform vec2 a = vec3(1.0); // A.\nvec4 pixel(ivec2 at) {}", r":2: a: the default must be numbers"),
        ("// A.\nuniform vec3 a = vec3(1.0, 2.0); // A.\nvec4 pixel(ivec2 at) {}", r":2: a: 2 numbers are no vec3"),
        ("// A.\nuniform float a = 9.0; // 0..1; A.\nvec4 pixel(ivec2 at) {}", r":2: a: .*9.0 is outside 0.0..1.0"),
        (
            "// A.\nfield3 v; // V.\nuniform vec2 v_spacing;\nfloat voxel(ivec3 at) {}",
            r":3: v_spacing is filled in as vec3",
        ),
        ("// A.\nfloat helper(float x) { return x; }", "there is no entry"),
        ("// A.\nfield2 a; // A.\nfloat voxel(ivec3 at) { return 0.0; }", "needs a field3 or field3u"),
        ("// A.\nuint pixel(ivec2 at) { return 0u; }", "pixel.. returns vec4"),
        ("// A.\nuniform float size; // S.\nvec4 pixel(ivec2 at) {}", ":2: size is a word of the device"),
        ("// A.\nuniform vec2 result_size;\nvec4 pixel(ivec2 at) {}", ":2: result_size is filled in as ivec2"),
        ("// A.\nuniform float id; // S.\nvec4 pixel(ivec2 at) {}", "Gain.id: this name is reserved"),
        ("// A.\n// Version: two\nvec4 pixel(ivec2 at) {}", "Version: give a whole number"),
    ],
)
def test_what_cannot_become_a_processor_says_where(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(UnknownProcessor, match=f"^image.gain: this processor is unavailable: .*{message}"):
        make(tmp_path, text)


@pytest.mark.parametrize("text", [GAIN, OPACITY, RAMP, DOUBLE], ids=["gain", "opacity", "ramp", "double"])
def test_the_patterns_agree_with_the_translator(tmp_path: Path, text: str) -> None:
    glsl_processor.verify(make(tmp_path, text))


def test_disagreement_with_the_translator_is_found(tmp_path: Path) -> None:
    hidden = "float half_of(float x) { return 0.5 * x; } uniform float gain = 2.0;"
    made = make(tmp_path, GAIN.replace("uniform float gain = 2.0;    // 0..10; Factor.", hidden))
    assert list(made.params) == []
    with pytest.raises(ShaderError, match="declare each field and uniform on one line of this file: gain"):
        glsl_processor.verify(made)


def test_a_picture_on_every_device(tmp_path: Path, device: Any, rng: np.random.Generator) -> None:
    gain = make(tmp_path, GAIN)
    image = data.Image(rng.random((4, 5, 4)).astype("f4"), depth=np.ones((4, 5), "f4"))
    result = gain().process(image=image, gain=3.0, device=OneDevice(device, gain))
    assert result.size == (5, 4)
    np.testing.assert_allclose(result.color[..., :3], 3.0 * image.color[..., :3], rtol=1e-6)
    np.testing.assert_array_equal(result.color[..., 3], image.color[..., 3])
    np.testing.assert_array_equal(result.depth, image.depth)


def test_a_volume_on_every_device(tmp_path: Path, device: Any, rng: np.random.Generator) -> None:
    opacity = make(tmp_path, OPACITY, "filter/opacity")
    volume = data.Volume(rng.random((4, 5, 6)).astype("f4"), np.diag([1.0, 2.0, 3.0, 1.0]))
    table = data.TransferFunction([(0.0, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.5)])
    result = opacity().process(volume=volume, table=table, power=2, device=OneDevice(device, opacity))
    expected = (table.evaluate(volume.data.ravel())[:, 3].reshape(volume.data.shape) * 3.0) ** 2
    np.testing.assert_allclose(result.data, expected, atol=2e-4)
    np.testing.assert_array_equal(result.index_to_world, volume.index_to_world)


def test_size_and_depth_on_every_device(tmp_path: Path, device: Any) -> None:
    ramp = make(tmp_path, RAMP, "source/ramp")
    given = {**ramp.defaults(), "flip": False}
    result = ramp().process(**given, size=(8, 2), device=OneDevice(device, ramp))
    x = np.broadcast_to(np.arange(8) / 8, (2, 8))
    np.testing.assert_allclose(result.color[..., 0], 1.0 - x, atol=1e-6)
    np.testing.assert_allclose(result.depth, x, atol=1e-6)


def test_ids_and_several_outputs_on_every_device(tmp_path: Path, device: Any) -> None:
    double = make(tmp_path, DOUBLE, "labels/double")
    labels = data.Labels(np.array([[[0, 1, 2**24 + 1]]], "u4"))
    result = double.pack(double().process(ids=labels, device=OneDevice(device, double)))
    assert result["twice"].data.tolist() == [[[0, 2, 2**25 + 2]]]
    assert result["there"].data.tolist() == [[[0.0, 1.0, 1.0]]]
