"""Directives, declarations, layouts: what can be seen without a device."""

from __future__ import annotations

import pytest

from nodegraph.compute import language
from nodegraph.compute.language import Matrix, Module, Numeric, Storage, Struct
from nodegraph.errors import ShaderError

KERNEL = """
// Shade a volume.
//
// Second paragraph.
#ifndef LIT
#define LIT 0
#endif
#define GAIN -2.5
struct Camera { vec3 eye; mat4 to_world; int kind; };
uniform float gain = GAIN;          // 0..10; Factor.
uniform vec3 tint = vec3(1.0, 0.5, -1.0);
uniform Camera cameras[2];
uniform int unused;
#if LIT && !defined(FLAT)
uniform vec3 light;
field3 normals;
#elif LIT > 1
#error
#endif
field3 volume; // The data.
field1 table;
struct Result { vec4 color; uint id; };
Result pixel(ivec2 at) {
    vec3 p = transform(cameras[at.x & 1].to_world, vec4(cameras[0].eye, 1.0)).xyz;
#if LIT
    p += light * sample3(normals, p);
#endif
    return Result(sample3(volume, p) * gain * vec4(tint, 1.0), uint(cameras[1].kind));
}
"""


def test_module_says_what_a_kernel_declares() -> None:
    module = language.compile(KERNEL)
    uniforms = {uniform.name: uniform for uniform in module.uniforms}
    assert list(uniforms) == ["gain", "tint", "cameras", "unused"]
    assert (uniforms["gain"].default, uniforms["gain"].doc) == (-2.5, "0..10; Factor.")
    assert uniforms["tint"].default == (1.0, 0.5, -1.0)
    assert (uniforms["cameras"].count, str(uniforms["cameras"].type), uniforms["cameras"].default) == (
        2,
        "Camera",
        None,
    )
    assert isinstance(uniforms["cameras"].type, Struct)
    assert [name for name, uniform in uniforms.items() if uniform.used] == ["gain", "tint", "cameras"]
    assert [(field.name, field.kind, field.doc, field.used) for field in module.fields] == [
        ("volume", "field3", "The data.", True),
        ("table", "field1", "", False),
    ]
    assert [(output.name, str(output.type)) for output in module.outputs] == [("color", "vec4"), ("id", "uint")]
    assert module.entry == "pixel"
    assert module.absent == {"light", "normals"}
    assert module.doc == "Shade a volume.\n\nSecond paragraph."


def test_defines_of_the_host_win() -> None:
    lit = language.compile(KERNEL, {"LIT": 1})
    assert [field.name for field in lit.fields] == ["normals", "volume", "table"]
    assert lit.absent == frozenset()
    assert language.compile(KERNEL, {"GAIN": 3.0}).uniforms[0].default == 3.0
    assert language.compile(KERNEL, {"LIT": True}).absent == frozenset()
    assert language.compile(KERNEL, {"LIT": False}).absent == {"light", "normals"}
    with pytest.raises(ShaderError, match=r"kernel.glsl:18: #error was reached"):
        language.compile(KERNEL, {"LIT": 2, "FLAT": 1})


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("1 + 2 * 3 == 7", True),
        ("(1 + 2) * 3 == 7", False),
        ("A > 2 && B < 0 || 0", True),
        ("!defined(A)", False),
        ("defined B && !defined(C)", True),
        ("-7 / 2 == -3 && -7 % 2 == -1", True),
        ("A != 3 || B >= -2", True),
        ("true && !false", True),
        ("0x10 <= 15", False),
    ],
)
def test_conditions(condition: str, holds: bool) -> None:
    text = f"#define A 3\n#define B -2\n#if {condition}\n#define R 1.0\n#else\n#define R 2.0\n#endif\n"
    module = language.compile(text + "uniform float x = R;\nfloat pixel(ivec2 at) { return x; }")
    assert module.uniforms[0].default == (1.0 if holds else 2.0)


def leaves_of(module: Module) -> dict[tuple[str | int, ...], tuple[str, str, int]]:
    _, layout = language.print_opencl(module, {"volume": (Storage("i2", scale=2.0),)})
    return {leaf.path: (leaf.name, leaf.block, leaf.offset) for leaf in layout.leaves}


def test_layout_places_every_leaf() -> None:
    assert leaves_of(language.compile(KERNEL)) == {
        ("gain",): ("u_gain", "real", 2),
        ("tint",): ("u_tint", "real", 3),
        ("cameras", 0, "eye"): ("u_cameras[0].m_eye", "real", 6),
        ("cameras", 0, "to_world"): ("u_cameras[0].m_to_world", "real", 9),
        ("cameras", 0, "kind"): ("u_cameras[0].m_kind", "int", 3),
        ("cameras", 1, "eye"): ("u_cameras[1].m_eye", "real", 25),
        ("cameras", 1, "to_world"): ("u_cameras[1].m_to_world", "real", 28),
        ("cameras", 1, "kind"): ("u_cameras[1].m_kind", "int", 4),
    }


def test_layout_of_opencl_lists_arguments_in_order() -> None:
    module = language.compile(KERNEL)
    text, layout = language.print_opencl(module, {"volume": (Storage("i2", scale=2.0),)}, "double")
    names = ("output color", "output id", "field volume[0]", "reals", "ints", "width", "height", "depth")
    assert layout.arguments == names
    assert (layout.reals, layout.ints, layout.kernel) == (44, 5, "ng_kernel")
    slot = layout.slots[0]
    assert (slot.argument, slot.size_offset, slot.mapping_offset) == (2, 0, 0)
    assert "typedef double real;" in text
    assert "0.5f" not in text


def test_what_a_variant_does_not_use_is_not_printed() -> None:
    text, layout = language.print_glsl(language.compile(KERNEL), {"volume": (Storage("f4", filtered=True),)})
    assert [slot.field for slot in layout.slots] == ["volume"]
    assert layout.slots[0].mapping == ""
    assert layout.slots[0].inverse != ""
    assert "unused" not in text
    assert "light" not in text


def test_scale_and_offset_do_not_change_the_text() -> None:
    module = language.compile(KERNEL)
    one, two = ({"volume": (Storage("u2", scale=s, offset=1.0, unorm=65535.0),)} for s in (2.0, 3.0))
    assert language.print_glsl(module, one)[0] == language.print_glsl(module, two)[0]
    assert language.print_opencl(module, one)[0] == language.print_opencl(module, two)[0]
    assert one["volume"][0].variant == two["volume"][0].variant


def test_eight_fetches_where_the_texture_unit_is_not_exact() -> None:
    module = language.compile(KERNEL)
    text, layout = language.print_glsl(module, {"volume": (Storage("u1", unorm=255.0),)})
    assert text.count("texelFetch(") == 8
    assert "textureLod(" not in text
    assert layout.slots[0].inverse == ""


def test_large_volumes_use_long_offsets() -> None:
    module = language.compile(KERNEL)
    text, _ = language.print_opencl(module, {"volume": (Storage("u1", large=True),)})
    assert "const size_t o0" in text
    assert "const size_t" not in language.print_opencl(module, {"volume": (Storage("u1"),)})[0].split("__kernel")[0]


def test_compute_stage() -> None:
    module = language.compile("float voxel(ivec3 at) { return float(at.z); }")
    text, layout = language.print_glsl(module, {}, "compute", 430)
    assert "layout(binding = 0, r32f) writeonly uniform image3D o0;" in text
    assert (layout.origin, layout.extent, layout.group) == ("ng_origin", "ng_extent", (8, 8, 1))
    assert language.print_glsl(module, {})[1].slice == "ng_slice"
    with pytest.raises(ValueError, match="version 430"):
        language.print_glsl(module, {}, "compute", 330)
    with pytest.raises(ValueError, match="voxel entries"):
        language.print_glsl(language.compile("float pixel(ivec2 at) { return 0.0; }"), {}, "compute", 430)
    with pytest.raises(ValueError, match="geometry"):
        language.print_glsl(module, {}, "geometry")


def test_wrong_storages_are_errors_of_the_caller() -> None:
    module = language.compile(KERNEL)
    with pytest.raises(ValueError, match="volume: 1 storages are needed, and 0 are given"):
        language.print_glsl(module, {})
    with pytest.raises(ValueError, match="OpenCL has no buffers of f2"):
        language.print_opencl(module, {"volume": (Storage("f2"),)})
    with pytest.raises(ValueError, match="half"):
        language.print_opencl(module, {"volume": (Storage("f4"),)}, "half")


def test_compiling_is_cached_by_text_and_by_kind_of_define() -> None:
    assert language.compile(KERNEL) is language.compile(KERNEL)
    text = "#define A 1.0\nuniform float x = A;\nfloat pixel(ivec2 at) { return x; }"
    assert language.compile(text, {"A": 1.0}).uniforms[0].default == 1.0
    with pytest.raises(ShaderError, match=r"write 1\.0"):
        language.compile(text, {"A": 1})


def test_types_print_as_they_are_written() -> None:
    names = [str(t) for t in (Numeric("float"), Numeric("uint", 3), Numeric("bool", 2), Matrix(4))]
    assert names == ["float", "uvec3", "bvec2", "mat4"]
