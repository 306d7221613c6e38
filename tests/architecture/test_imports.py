"""What importing the package loads: numpy and the standard library, and nothing slow of the latter."""

from __future__ import annotations

import json
import subprocess
import sys
import textwrap

import pytest

#: What numpy loads, and what `import nodegraph` may add to it besides itself.
ALLOWED = {"nodegraph", "numpy"}

#: Parts of the standard library that cost milliseconds each and are needed by no declaration.
SLOW = {
    "argparse", "asyncio", "concurrent.futures.process", "email", "http", "importlib.metadata", "inspect", "json",
    "multiprocessing", "sqlite3", "ssl", "subprocess", "tempfile", "typing_extensions", "unittest", "urllib.request",
    "xml", "zipfile",
}  # fmt: skip

CODE = """
import json, sys
import numpy
before = set(sys.modules)
{statement}
print(json.dumps(sorted(set(sys.modules) - before)))
"""


def loaded_by(statement: str) -> set[str]:
    """Names of the modules that a statement adds to those of numpy, in a fresh interpreter."""
    code = CODE.format(statement=textwrap.dedent(statement))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


def outsiders(modules: set[str]) -> set[str]:
    """Modules that belong neither to what is allowed nor to the standard library."""
    tops = {name.partition(".")[0] for name in modules}
    return {top for top in tops if top not in ALLOWED and top not in sys.stdlib_module_names}


def test_import_loads_numpy_and_cheap_parts_of_the_standard_library() -> None:
    modules = loaded_by("import nodegraph")
    assert outsiders(modules) == set()
    assert modules & SLOW == set()


def test_import_loads_no_device_no_format_and_no_command() -> None:
    modules = loaded_by("import nodegraph")
    heavy = {"compute", "formats", "cli", "testing", "engine", "scheduler", "registry", "workspace", "batch"}
    assert {name for name in modules if name.partition(".")[2].split(".")[0] in heavy} == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    "statement",
    [
        "import nodegraph; nodegraph.Engine",
        "import nodegraph; nodegraph.load",
        "import nodegraph; nodegraph.processors.render",
        "import nodegraph.compute",
        "import nodegraph.compute.language",
        "import nodegraph.formats",
        "import nodegraph.cli.run",
        "import nodegraph.batch",
        "from nodegraph.cli import main; main(['--help'])",
    ],
)
def test_libraries_are_loaded_when_used_and_not_before(statement: str) -> None:
    redirected = "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n" + textwrap.indent(
        statement, "    "
    )
    assert outsiders(loaded_by(redirected)) == set()


def test_listing_processors_loads_no_device_and_no_format_library() -> None:
    modules = loaded_by("from nodegraph import registry; assert registry.catalogue()")
    assert (
        outsiders(modules) & {"moderngl", "pyopencl", "PySide6", "OpenImageIO", "nibabel", "nrrd", "matplotlib", "zarr"}
        == set()
    )
