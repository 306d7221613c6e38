"""What every processor keeps to, as checks that anybody can run on their own.

    import pytest, nodegraph.testing
    from my_plugin import Sharpen

    @pytest.mark.parametrize("check", nodegraph.testing.contract(Sharpen), ids=str)
    def test_contract(check):
        check()

Each check raises `ContractError` with a sentence that names the place.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nodegraph.data import Value
from nodegraph.errors import FormatError, GraphError, ParameterError, PortError
from nodegraph.processor import Processor
from nodegraph.signature import snake
from nodegraph.testing import samples
from nodegraph.testing.bench import Bench, default_bench

if TYPE_CHECKING:
    from nodegraph.registry import Registry

#: Libraries that a processor may use but must not load before it runs.
HEAVY = (
    "moderngl", "pyopencl", "PySide6", "PyQt6", "OpenImageIO", "PIL", "av", "h5py", "imagecodecs", "imageio",
    "matplotlib", "nibabel", "nrrd", "pydicom", "SimpleITK", "tifffile", "vtk", "zarr",
)  # fmt: skip

Subject = tuple[type[Processor], Mapping[str, Any]]


class ContractError(AssertionError):
    """A processor that breaks the contract."""


class Check:
    """One named check of one processor. Call it, with a bench where one is open already."""

    def __init__(self, name: str, subject: Subject, run: Callable[[type[Processor], Mapping[str, Any], Bench], None]):
        self.name = name
        self.processor, self.values = subject
        self._run = run

    def __call__(self, bench: Bench | None = None) -> None:
        self._run(self.processor, self.values, bench or default_bench())

    def __str__(self) -> str:
        return f"{self.processor.id}-{self.name}"

    __repr__ = __str__


def contract(
    processor: type[Processor], values: Mapping[str, Any] | None = None, *, imports: bool = True
) -> list[Check]:
    """The checks of a processor. ``values`` are inputs and parameters for an ordinary call, where samples do not do.

    ``imports=False`` leaves out the one that starts an interpreter; `heavy_imports` does it for many at once.
    """
    chosen = dict(CHECKS)
    if not imports:
        del chosen["light_import"]
    return [Check(name, (processor, dict(values or {})), run) for name, run in chosen.items()]


def verify(processor: type[Processor], values: Mapping[str, Any] | None = None, bench: Bench | None = None) -> None:
    """Run all checks; raise one ContractError that lists every broken one."""
    broken = []
    for check in contract(processor, values):
        try:
            check(bench)
        except ContractError as error:
            broken.append(f"{check.name}: {error}")
    if broken:
        raise ContractError("\n".join(broken))


# -- the declaration ----------------------------------------------------------------------------------------------


def documented(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """The class says in a sentence what it does, and so does each port and parameter."""
    text = (cls.__dict__.get("__doc__") or "").strip()
    _require(bool(text), f"{cls.__name__}: say in a docstring what the processor does")
    first = text.split("\n\n")[0]
    _require(
        first.endswith((".", "!", "?", ":")), f"{cls.__name__}: the docstring begins with a sentence, not {first!r}"
    )
    docs = {name: part.doc for part_of in (cls.inputs, cls.outputs, cls.params) for name, part in part_of.items()}
    for name, doc in docs.items():
        _require(len(doc) > 2 and doc.endswith("."), f"{cls.__name__}.{name}: doc is a sentence, not {doc!r}")


def id_is_path(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """The id is the path of the file, and the class is called after the file."""
    stem = cls.id.rpartition(".")[2]
    _require(
        cls.__name__.lower() == stem.replace("_", "") or snake(cls.__name__) == stem,
        f"{cls.__name__}: the id ends in {stem!r}; class, file and id share one name",
    )
    if cls.file:
        path, parts = Path(cls.file).with_suffix("").parts, tuple(cls.id.split("."))
        _require(path[-len(parts) :] == parts, f"{cls.__name__}: the id {cls.id} is not the path {cls.file}")


def valid_defaults(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Every default is a legal value in its normal form."""
    for name, parameter in cls.params.items():
        checked = parameter.check(parameter.default, f"{cls.__name__}.{name}")
        _require(checked == parameter.default, f"{cls.__name__}.{name}: the default is not in its normal form")
    _require(cls.effective({}) == cls.defaults(), f"{cls.__name__}: defaults do not stay when nothing is set")


def json_round_trip(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Every value survives JSON, and so does the declaration."""
    for name, parameter in cls.params.items():
        where = f"{cls.__name__}.{name}"
        for value in (parameter.default, samples.another(parameter)):
            text = json.dumps(parameter.encode(value), allow_nan=False)
            _require(parameter.decode(json.loads(text), where) == value, f"{where}: {value!r} does not survive JSON")
    told = cls.describe()
    _require(json.loads(json.dumps(told, allow_nan=False)) == told, f"{cls.__name__}: describe() does not survive JSON")


def fingerprinted(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Every visible parameter changes what results are kept under; one that is not visible does not."""
    from nodegraph.fingerprint import code_of, local_of
    from nodegraph.flat import FlatNode

    code = code_of(cls)

    def key(given: Mapping[str, Any]) -> bytes:
        effective = cls.effective(given)
        shown = {name: effective[name] for name in cls.visible(given)}
        return local_of(FlatNode("node", cls.id, cls, {}, {}, shown, None, 1), code).digest

    for name, parameter in cls.params.items():
        where = f"{cls.__name__}.{name}"
        before = samples.made_visible(cls, name)
        _require(name in cls.visible(before), f"{where}: no values of other parameters make it visible")
        changed = {**before, name: samples.another(parameter)}
        _require(key(before) != key(changed), f"{where}: changing it does not change the fingerprint")
        if name not in cls.visible({}):
            hidden = {name: samples.another(parameter)}
            _require(key({}) == key(hidden), f"{where}: it changes the fingerprint while it is not visible")


def kernels_found(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Every kernel that it names can be read; a processor that is a kernel says the same as the translator."""
    from nodegraph.kernel_sources import kernel_source

    for name in cls.kernels:
        try:
            kernel_source(cls, name)
            if cls.file.endswith(".glsl"):
                from nodegraph import glsl_processor

                glsl_processor.verify(cls)
        except GraphError as error:
            raise ContractError(f"{cls.__name__}: {error}") from error


# -- the function -----------------------------------------------------------------------------------------------------


def repeatable(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """The same input twice gives the same bytes, and inputs stay as they are."""
    with tempfile.TemporaryDirectory() as folder:
        given = samples.arguments(cls, Path(folder), values)
        before = {name: _digest(given[name]) for name in cls.inputs}
        first = _digest(_allowed(cls, bench, given, "an ordinary call"))
        second = _digest(_allowed(cls, bench, given, "the same call again"))
        _require(first == second, f"{cls.__name__}: the same input twice gives different results")
        for name, digest in before.items():
            _require(_digest(given[name]) == digest, f"{cls.__name__}.{name}: process() changed its input")


def each_output_alone(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Asked for one output only, it gives that, and the same as when asked for all."""
    if "wanted" not in cls.services:
        return
    with tempfile.TemporaryDirectory() as folder:
        given = samples.arguments(cls, Path(folder), values)
        whole = _allowed(cls, bench, given, "an ordinary call")
        for name in cls.outputs:
            alone = _allowed(cls, bench, given, f"a call for {name} alone", wanted=(name,))
            if isinstance(whole, dict) and isinstance(alone, dict):
                same = _digest(alone[name]) == _digest(whole[name])
                _require(same, f"{cls.__name__}.{name}: differs when it is wanted alone")


def odd_inputs(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Unusual values of every input work or are refused with a PortError, ParameterError or FormatError."""
    with tempfile.TemporaryDirectory() as folder:
        given = samples.arguments(cls, Path(folder), values)
        for name, port in cls.inputs.items():
            for kind, make in samples.odd(port):
                try:
                    value = make()
                except PortError:
                    continue  # the value itself refuses to be, so it never reaches a port
                _allowed(cls, bench, {**given, name: value}, f"{name}: {kind}")
            if not port.required:
                _allowed(cls, bench, {**given, name: None}, f"{name}: nothing connected")


def every_choice(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Every choice and both states of every switch work on ordinary inputs, or are refused."""
    with tempfile.TemporaryDirectory() as folder:
        given = samples.arguments(cls, Path(folder), values)
        for name, parameter in cls.params.items():
            told = parameter.describe()
            options = told.get("choices", [True, False] if told["kind"] == "Bool" else [])
            for option in options:
                case = {**given, **samples.made_visible(cls, name), name: option}
                _allowed(cls, bench, case, f"{name} = {option!r}")


def light_import(cls: type[Processor], values: Mapping[str, Any], bench: Bench) -> None:
    """Loading its file loads no graphics, user interface or file format library."""
    _require(bool(cls.file), f"{cls.__name__}: defined in no file, so its import cannot be looked at")
    for id, modules in heavy_imports([cls]).items():
        raise ContractError(f"{id}: its import loads {', '.join(modules)}; import these inside process()")


def heavy_imports(processors: Iterable[type[Processor]]) -> dict[str, list[str]]:
    """Heavy libraries that loading each file adds in one fresh interpreter, by id; those that add none are left out."""
    files = [[cls.id, cls.file, list(cls.shader_roots)] for cls in processors]
    code = (
        "import json, sys\n"
        "from pathlib import Path\n"
        "from nodegraph import loading\n"
        "files, heavy = json.loads(sys.stdin.read())\n"
        "found = {}\n"
        "for id, file, roots in files:\n"
        "    before = set(sys.modules)\n"
        "    loading.load(id, Path(file), [Path(root) for root in roots], built_in=False)\n"
        "    added = sorted({name.partition('.')[0] for name in set(sys.modules) - before} & set(heavy))\n"
        "    if added:\n"
        "        found[id] = added\n"
        "sys.__stdout__.write(json.dumps(found))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}\n{code}"],
        input=json.dumps([files, HEAVY]),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise ContractError(f"importing in a fresh interpreter fails: {done.stderr.strip().splitlines()[-1]}")
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


CHECKS: dict[str, Callable[[type[Processor], Mapping[str, Any], Bench], None]] = {
    check.__name__: check
    for check in (
        documented,
        id_is_path,
        valid_defaults,
        json_round_trip,
        fingerprinted,
        kernels_found,
        repeatable,
        each_output_alone,
        odd_inputs,
        every_choice,
        light_import,
    )
}


def _require(holds: bool, message: str) -> None:
    if not holds:
        raise ContractError(message)


def _allowed(cls: type[Processor], bench: Bench, given: Mapping[str, Any], case: str, **how: Any) -> Any:
    """The outputs, or an error that a processor may raise for what it was given; anything else breaks the contract."""
    try:
        return bench.call(cls, given, **how)
    except (PortError, ParameterError, FormatError) as error:
        return error
    except Exception as error:
        raise ContractError(f"{cls.__name__}: {case}: raises {type(error).__name__}: {error}") from error


def _digest(value: Any) -> bytes:
    """What a value holds, as a key; errors count by their text."""
    from nodegraph.fingerprint import content_key, digest

    if isinstance(value, GraphError):
        return digest("error", type(value).__name__, str(value))
    if isinstance(value, Mapping):
        return digest("outputs", *(part for name in sorted(value) for part in (name, _digest(value[name]))))
    if isinstance(value, (tuple, list)):
        return digest("many", *map(_digest, value))
    return content_key(value) if _has_content(value) else digest("repr", repr(value))


def _has_content(value: Any) -> bool:
    if not isinstance(value, Value):
        return True
    return type(value).to_parts is not Value.to_parts


def processors_of(folder: str | Path) -> list[type[Processor]]:
    """Every processor of a plug-in folder, for a sweep. Raises ContractError naming those that are unavailable."""
    registry = _registry_of(folder)
    broken = [f"{entry['id']}: {entry['unavailable']}" for entry in registry.catalogue() if "unavailable" in entry]
    _require(not broken, "\n".join(broken))
    return [registry.find(id) for id in registry.ids()]


def processor_of(folder: str | Path, id: str) -> type[Processor]:
    """One processor of a plug-in folder. Raises UnknownProcessor with the reason why there is none."""
    return _registry_of(folder).find(id)


def call(processor: type[Processor], **values: Any) -> Any:
    """The value of the one output of a processor, or a named tuple of several, outside any network."""
    outputs = default_bench().call(processor, values)
    return processor.Outputs(**outputs) if processor.Outputs else next(iter(outputs.values()), None)


def _registry_of(folder: str | Path) -> Registry:
    from nodegraph import locations
    from nodegraph.registry import Registry

    return Registry([locations.plugin_folder(Path(folder), str(folder))])
