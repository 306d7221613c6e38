"""Processors that are nothing but a kernel: one ``.glsl`` file whose declarations become ports and parameters.

    // Brighten a picture.
    // Alpha and depth stay as they are.
    field2 image;                // Picture.
    uniform float gain = 2.0;    // 0..10; Factor.

    vec4 pixel(ivec2 at) {
        vec4 color = fetch2(image, at);
        return vec4(gain * color.rgb, color.a);
    }

The comment that opens the file documents the processor; lines ``Version: 2`` and ``Formerly: image.gain`` in it say
what the class attributes of the same names say. Each declaration stands on a line of its own and is documented by the
comment behind it, which may begin with a range and a unit: ``// 0..10 mm; Width.``

====================  ==========================================================================================
field3, field3v       Input(Volume) of one, or of 2 to 4, numbers per voxel
field3u               Input(Labels)
field2, field2u       Input(Image); its colour, or its ids
field1                TransferFunction parameter, bound as a table of `TABLE_SIZE` rows
uniform               Float, Int, Bool, Vector, Matrix by type; a vec3 or vec4 called ``*color*`` is a Color;
                      ``Camera`` (of common/camera.glsl) is a Camera, in the index space of the first volume
====================  ==========================================================================================

Bound by themselves, when declared: ``uniform vec2 T_lookup`` (scale and offset from a value to a row of table T),
``uniform vec3 V_spacing`` (mm), ``uniform mat4 V_to_world`` and ``V_from_world`` of volume V, and
``uniform ivec2 result_size`` (ivec3 for voxels).

``pixel`` gives an Image, as large as the first input image, else as was asked for; a struct of ``vec4 color`` and
``float depth`` gives an Image with depth. ``voxel`` gives, on the grid of the first field, a Volume, or Labels when it
returns uint; a struct gives one output per member. The file is read by a few patterns, so that listing processors
compiles nothing; `verify` checks that they agree with the translator.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from nodegraph import params
from nodegraph.data import Image, Labels, Volume
from nodegraph.errors import GraphError, ShaderError
from nodegraph.params import Parameter
from nodegraph.ports import Input, Output, has_components, has_ids
from nodegraph.processor import Processor
from nodegraph.signature import camel

TABLE_SIZE = 1024

_DECLARATION = re.compile(
    r"(?:(?P<uniform>uniform)\s+)?(?P<type>\w+)\s+(?P<name>\w+)\s*(?P<array>\[.*?\])?\s*(?:=\s*(?P<default>[^;]+?))?\s*;"
    r"\s*(?://+\s*(?P<comment>.*))?"
)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_RANGE = re.compile(
    rf"(?P<low>{_NUMBER})?\s*\.\.\s*(?P<high>{_NUMBER})?\s*(?P<unit>[^;]*?)\s*;\s*(?P<doc>.*)", re.DOTALL
)
_ENTRY = re.compile(r"^\s*(\w+)\s+(pixel|voxel)\s*\(", re.MULTILINE)
_STRUCT = re.compile(r"struct\s+(\w+)\s*\{(.*?)\}", re.DOTALL)
_MEMBER = re.compile(r"(\w+)\s+(\w+)\s*;")
_VECTOR = re.compile(r"([iu]?)vec([234])")
_TAKEN = {"kernel", "size", "defines", "check", "progress"}  # arguments of device.run
_AUTOMATIC = {"lookup": "vec2", "spacing": "vec3", "to_world": "mat4", "from_world": "mat4"}


class Declared(NamedTuple):
    """One field or uniform as the file declares it. ``line`` counts from 1."""

    uniform: bool
    type: str
    name: str
    default: str
    doc: str
    line: int


class Introspection(NamedTuple):
    """What a kernel file says of itself. ``outputs`` are (name, type); one of them is called "" for a plain result."""

    doc: str
    version: int
    formerly: tuple[str, ...]
    declared: tuple[Declared, ...]
    entry: str
    outputs: tuple[tuple[str, str], ...]


def introspect(text: str, file: str) -> Introspection:
    """Read a kernel file. Raises ShaderError, with the line, for what cannot become a port or a parameter."""
    doc, settings = _header(text)
    code = re.sub(r"/\*.*?\*/", lambda comment: re.sub(r"[^\n]", " ", comment[0]), text, flags=re.DOTALL)
    declared = []
    for number, line in enumerate(code.splitlines(), 1):
        if re.match(r"\s*(uniform|field[123][uv]?)\b", line):
            declared.append(_declaration(line.strip(), number, file))
    bare = re.sub(r"//[^\n]*", "", code)
    entry = _ENTRY.search(bare)
    if entry is None:
        raise ShaderError("there is no entry: write vec4 pixel(ivec2 at) or float voxel(ivec3 at)", file=file, line=1)
    structs = {name: tuple((n, t) for t, n in _MEMBER.findall(body)) for name, body in _STRUCT.findall(bare)}
    outputs = structs.get(entry[1], (("", entry[1]),))
    version = settings.get("version", "1")
    if not version.isdecimal() or version == "0":
        raise ShaderError(f"Version: give a whole number from 1, not {version!r}", file=file, line=1)
    formerly = tuple(re.split(r"[,\s]+", settings["formerly"])) if settings.get("formerly") else ()
    return Introspection(doc, int(version), formerly, tuple(declared), entry[2], outputs)


def make(id: str, path: Path, text: str) -> type[Processor]:
    """Return the processor class of a kernel file. Raises ShaderError or TypeError for one that makes no processor."""
    file = f"{id.replace('.', '/')}.glsl"
    found = introspect(text, file)
    name = camel(id.rpartition(".")[2])
    members: dict[str, Any] = {"__doc__": found.doc, "__module__": _module(id, path), "version": found.version}
    members["formerly"] = found.formerly
    automatic: dict[str, str] = {}
    names = {each.name for each in found.declared}
    for each in found.declared:
        source = _automatic(each, names, found.entry, file)
        if source:
            automatic[each.name] = each.type
        else:
            members[each.name] = _port_or_parameter(each, file)
    members.update(_outputs(found, members, file))
    kernel = id.replace(".", "/")
    positional = [each.name for each in found.declared if each.name not in automatic]

    def process(self: Processor, **given: Any) -> Any:
        return _run(type(self), kernel, found, automatic, given)

    # Only a picture that is made of no picture depends on the size that was asked for.
    free = found.entry == "pixel" and not any(isinstance(m, Input) and m.type is Image for m in members.values())
    process.argument_names = (positional, ("size", "device") if free else ("device",))  # type: ignore[attr-defined]
    members["process"] = process
    return type(name, (Processor,), members)


def verify(processor: type[Processor], defines: Mapping[str, Any] | None = None) -> None:
    """Compile the kernel with the translator and compare what it declares with what was read by patterns.

    Raises ShaderError where they differ or the kernel lies outside the language.
    """
    from nodegraph import shaders
    from nodegraph.compute import language

    source = shaders.load(processor.kernels[0], processor.shader_roots)
    module = language.compile(source, dict(defines or {}))
    found = introspect(Path(processor.file).read_text("utf-8"), processor.file)
    read = {each.name for each in found.declared}
    true = {uniform.name for uniform in module.uniforms} | {field.name for field in module.fields} | module.absent
    if read != true or module.entry != found.entry:
        odd = ", ".join(sorted(read ^ true)) or module.entry
        raise ShaderError(
            f"declare each field and uniform on one line of this file: {odd}", file=processor.file, line=1
        )


# -- reading ---------------------------------------------------------------------------------------------------


def _header(text: str) -> tuple[str, dict[str, str]]:
    """The comment that opens the file, without its markers and the name of the file, and the settings in it."""
    block = re.match(r"\s*/\*(.*?)\*/", text, re.DOTALL)
    if block:
        lines = [line.strip().lstrip("*").strip() for line in block[1].splitlines()]
    else:
        lines = []
        for line in text.splitlines():
            if not line.strip().startswith("//"):
                if lines or line.strip():
                    break
                continue
            lines.append(line.strip().lstrip("/").strip())
    if lines and re.fullmatch(r"[\w./-]+\.glsl", lines[0]):
        del lines[0]  # the file's own name, as examples carry it, documents nothing
    settings, kept = {}, []
    for line in lines:
        setting = re.fullmatch(r"(version|formerly)\s*:\s*(.*)", line, re.IGNORECASE)
        if setting:
            settings[setting[1].lower()] = setting[2].strip()
        else:
            kept.append(line)
    return "\n".join(kept).strip(), settings


def _declaration(line: str, number: int, file: str) -> Declared:
    match = _DECLARATION.fullmatch(line)
    if match is None:
        raise ShaderError(
            "write one declaration on a line, ended by ; and a comment", file=file, line=number, excerpt=line
        )
    if match["array"]:
        raise ShaderError("arrays cannot be ports or parameters: write the processor in Python", file=file, line=number)
    return Declared(
        bool(match["uniform"]), match["type"], match["name"], match["default"] or "", match["comment"] or "", number
    )


def _automatic(each: Declared, names: set[str], entry: str, file: str) -> bool:
    """Whether a uniform is filled in from an input instead of being a parameter."""
    if not each.uniform:
        return False
    owner, expected = "", ""
    if each.name in _TAKEN:
        raise ShaderError(f"{each.name} is a word of the device; choose another name", file=file, line=each.line)
    if each.name == "result_size":
        owner, expected = each.name, "ivec2" if entry == "pixel" else "ivec3"
    for suffix, type in _AUTOMATIC.items():
        if each.name.endswith(f"_{suffix}") and each.name[: -len(suffix) - 1] in names:
            owner, expected = each.name[: -len(suffix) - 1], type
    if owner and each.type != expected:
        raise ShaderError(f"{each.name} is filled in as {expected}, not {each.type}", file=file, line=each.line)
    return bool(owner)


def _port_or_parameter(each: Declared, file: str) -> Input | Parameter:
    limits = _RANGE.fullmatch(each.doc)
    doc = limits["doc"] if limits else each.doc
    if not doc:
        raise ShaderError(f"{each.name}: say what it is in a comment behind it", file=file, line=each.line)
    if not each.uniform:
        return _field(each, doc)
    try:
        return _uniform(each, doc, limits, file)
    except (GraphError, TypeError) as error:
        if isinstance(error, ShaderError):
            raise
        raise ShaderError(f"{each.name}: {error}", file=file, line=each.line) from None


def _field(each: Declared, doc: str) -> Input | Parameter:
    if each.type == "field1":
        return params.TransferFunction(doc=doc)
    if each.type == "field3":
        return Input(Volume, doc=doc, accepts=has_components(1))
    if each.type == "field3v":
        return Input(Volume, doc=doc, accepts=has_components(2, 3, 4))
    if each.type == "field3u":
        return Input(Labels, doc=doc)
    return Input(Image, doc=doc, accepts=has_ids() if each.type == "field2u" else ())


def _uniform(each: Declared, doc: str, limits: re.Match[str] | None, file: str) -> Parameter:
    numbers = _literal(each, file)
    common: dict[str, Any] = {"doc": doc}
    vector = _VECTOR.fullmatch(each.type)
    if each.type == "bool":
        return params.Bool(bool(numbers and numbers[0]), **common)
    if each.type == "Camera":
        return params.Camera(**common)
    if each.type == "mat4":
        return params.Matrix(**common)
    if vector and vector[1] == "" and int(vector[2]) >= 3 and "color" in each.name:
        return params.Color(numbers or (1.0,) * int(vector[2]), max=None, **common)
    if vector is None and each.type not in ("float", "int", "uint"):
        known = "float, int, uint, bool, vec2..4, ivec2..4, uvec2..4, mat4 and Camera"
        raise ShaderError(f"a uniform {each.type} cannot be a parameter; {known} can", file=file, line=each.line)
    whole = each.type != "float" and not (vector and vector[1] == "")
    count = int(vector[2]) if vector else 1
    number = int if whole else float
    low = number(float(limits["low"])) if limits and limits["low"] else None
    high = number(float(limits["high"])) if limits and limits["high"] else None
    if low is None and (each.type == "uint" or (vector and vector[1] == "u")):
        low = 0
    common |= {"min": low, "max": high, "unit": limits["unit"] if limits else ""}
    start = numbers or (max(low or 0, min(0, high if high is not None else 0)),)
    values = tuple(number(value) for value in (start * count if len(start) == 1 else start))
    if vector:
        return params.Vector(values, integer=whole, **common)
    return params.Int(values[0], **common) if whole else params.Float(values[0], **common)


def _literal(each: Declared, file: str) -> tuple[float, ...]:
    """Numbers of an initialiser: ``2.0``, ``true``, ``vec3(1.0)``, ``vec3(1.0, 0.5, 0.0)``; () where there is none."""
    text = each.default
    vector = _VECTOR.fullmatch(each.type)
    inner = re.fullmatch(rf"{each.type}\s*\((.*)\)", text, re.DOTALL)
    parts = [part.strip().rstrip("uUfF") for part in (inner[1] if inner else text).split(",")] if text else []
    words = {"true": 1.0, "false": 0.0}
    if not all(part in words or re.fullmatch(_NUMBER, part) for part in parts):
        raise ShaderError(f"{each.name}: the default must be numbers, as in vec2(1.0, 0.5)", file=file, line=each.line)
    numbers = tuple(words[part] if part in words else float(part) for part in parts)
    if len(numbers) > 1 and (vector is None or len(numbers) != int(vector[2])):
        raise ShaderError(f"{each.name}: {len(numbers)} numbers are no {each.type}", file=file, line=each.line)
    return numbers * int(vector[2]) if vector and len(numbers) == 1 else numbers


def _outputs(found: Introspection, members: dict[str, Any], file: str) -> dict[str, Output]:
    fields = [port for port in members.values() if isinstance(port, Input) and port.type is not Image]
    if found.entry == "pixel":
        shape = dict(found.outputs)
        if shape not in ({"": "vec4"}, {"": "float"}, {"": "vec2"}, {"color": "vec4", "depth": "float"}):
            raise ShaderError(
                "pixel() returns vec4, vec2, float, or a struct of vec4 color and float depth", file=file, line=1
            )
        return {"result": Output(Image, doc="The picture.")}
    if not fields:
        raise ShaderError("voxel() needs a field3 or field3u, whose grid the result has", file=file, line=1)
    return {
        name or "result": Output(Labels if type == "uint" else Volume, doc="On the grid of the first input.")
        for name, type in found.outputs
    }


def _module(id: str, path: Path) -> str:
    """A module that stands for the file, so that the class has a place like any other."""
    name = f"nodegraph.kernels.{id}"
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    return name


# -- running ---------------------------------------------------------------------------------------------------


def _run(
    cls: type[Processor], kernel: str, found: Introspection, automatic: dict[str, str], given: dict[str, Any]
) -> Any:
    device, size = given.pop("device"), given.pop("size", ())
    images = [given[name] for name, port in cls.inputs.items() if port.type is Image]
    grids = [given[name] for name, port in cls.inputs.items() if port.type is not Image]
    if found.entry == "voxel":
        size = grids[0].dims
    elif images:
        size = images[0].size
    bindings = {each.name: _bound(each, given, size, grids) for each in found.declared}
    result = device.run(kernel, size, **bindings)
    if found.entry == "pixel":
        if len(found.outputs) == 2:
            return Image(result.color, result.depth)
        same = images and images[0].size == size and found.outputs[0][1] == "vec4"
        return images[0].with_color(result) if same else Image(result)
    if cls.Outputs is None:
        name, type = found.outputs[0]
        return _on_grid(getattr(result, name) if name else result, type, grids[0])
    return cls.Outputs(**{name: _on_grid(getattr(result, name), type, grids[0]) for name, type in found.outputs})


def _on_grid(data: Any, type: str, grid: Volume | Labels) -> Volume | Labels:
    if type == "uint":
        return Labels(data, grid.index_to_world, getattr(grid, "names", None))
    return Volume(data, grid.index_to_world)


def _bound(each: Declared, given: dict[str, Any], size: tuple[int, ...], grids: list[Any]) -> Any:
    """What one declaration is bound to: a parameter or input by its name, or what follows from one."""
    if each.name in given:
        value = given[each.name]
        if each.type == "field1":
            return value.table(TABLE_SIZE)
        if each.type == "field2":
            return value.color_buffer
        if each.type == "field2u":
            return value.ids_buffer
        if each.type == "Camera":
            return value.rays(size, grids[0].world_to_index if grids else None)
        return value
    if each.name == "result_size":
        return size
    owner, suffix = next(
        (each.name[: -len(suffix) - 1], suffix) for suffix in _AUTOMATIC if each.name.endswith(f"_{suffix}")
    )
    value = given[owner]
    if suffix == "lookup":
        return value.lookup(TABLE_SIZE)
    return {"spacing": value.spacing, "to_world": value.index_to_world, "from_world": value.world_to_index}[suffix]
