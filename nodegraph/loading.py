"""Load one plug-in file and take the one processor class out of it."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import linecache
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from nodegraph.processor import Processor
from nodegraph.signature import camel


class PluginError(Exception):
    """A file that was loaded and does not hold what a plug-in holds."""


def load(id: str, path: Path, roots: Sequence[Path], *, built_in: bool, fresh: bool = False) -> type[Processor]:
    """Return the processor class of a ``.py`` or ``.glsl`` file, with its id, file, kernels and shader roots set.

    ``fresh`` reads the source anew instead of trusting compiled bytes, whose time stamps are coarse. Raises whatever
    the file raises, and PluginError when it does not hold exactly one processor of the right name.
    """
    source = path.read_bytes()
    if path.suffix == ".glsl":
        from nodegraph import glsl_processor

        try:
            text = source.decode("utf-8")
        except UnicodeDecodeError as error:
            line = source.count(b"\n", 0, error.start) + 1
            raise PluginError(f"line {line}: this is not UTF-8 text; save the file as UTF-8") from None
        processor = glsl_processor.make(id, path, text)
        processor.kernels = (id.replace(".", "/"),)
    else:
        module = _execute(_module_name(id, path, built_in), path, source if fresh else None)
        processor = _only_processor(module, path)
        if not any(
            "kernels" in ancestor.__dict__ for ancestor in processor.__mro__ if ancestor not in Processor.__mro__
        ):
            name = id.replace(".", "/")
            processor.kernels = (name,) if any((root / f"{name}.glsl").is_file() for root in roots) else ()
    processor.id = id
    processor.file = str(path)
    processor.shader_roots = tuple(map(str, roots))
    processor.source_digest = hashlib.blake2b(source, digest_size=20).digest()
    return processor


def _module_name(id: str, path: Path, built_in: bool) -> str:
    """A name that no other file has, and that is the same in every process: results on disk are keyed on it."""
    if built_in:
        return f"nodegraph.processors.{id}"
    mark = hashlib.blake2b(str(path).encode("utf-8", "surrogateescape"), digest_size=4).hexdigest()
    return f"nodegraph_plugin_{mark}.{id}"


def _execute(name: str, path: Path, source: bytes | None) -> ModuleType:
    """Run a file as a module; when it raises, whatever had the name before has it again."""
    loader = importlib.machinery.SourceFileLoader(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None:
        raise PluginError("this file cannot be imported")
    module = importlib.util.module_from_spec(spec)
    before = sys.modules.get(name)
    sys.modules[name] = module
    try:
        if source is None:
            loader.exec_module(module)
        else:
            linecache.checkcache(str(path))
            exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    except BaseException:
        if before is None:
            del sys.modules[name]
        else:
            sys.modules[name] = before
        raise
    return module


def _only_processor(module: ModuleType, path: Path) -> type[Processor]:
    own = [
        value
        for name, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, Processor)
        and value.__module__ == module.__name__
        and not value.abstract
        and not name.startswith("_")
    ]
    own = list(dict.fromkeys(own))
    expected = camel(path.stem)
    if not own:
        raise PluginError(f"the file defines no processor; expected class {expected}(Processor)")
    if len(own) > 1:
        listed = ", ".join(processor.__name__ for processor in own)
        raise PluginError(f"the file defines {len(own)} processors ({listed}); one file holds one, {expected}")
    if own[0].__name__.lower() != path.stem.replace("_", "").lower():
        raise PluginError(f"the class is called {own[0].__name__}; after its file it must be called {expected}")
    return own[0]
