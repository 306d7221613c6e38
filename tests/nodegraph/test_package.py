"""What `import nodegraph` offers, and when it loads it."""

from __future__ import annotations

import json
import subprocess
import sys
from types import FunctionType

import pytest

import nodegraph


def test_every_public_name_is_there() -> None:
    for name in nodegraph.__all__:
        assert getattr(nodegraph, name) is not None, name
    assert set(nodegraph.__all__) <= set(dir(nodegraph))


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'Netwrok'"):
        _ = nodegraph.Netwrok


def test_engine_stays_a_function_when_its_module_is_imported() -> None:
    from nodegraph.engine import Engine

    assert isinstance(nodegraph.engine, FunctionType)
    assert nodegraph.Engine is Engine


def test_parameter_kinds_and_values_of_one_name_are_told_apart() -> None:
    assert nodegraph.Camera is nodegraph.params.Camera
    assert nodegraph.Camera is not nodegraph.data.Camera
    assert nodegraph.Camera.value_type is nodegraph.data.Camera


def test_names_load_their_modules_when_first_used() -> None:
    code = (
        "import json, sys, nodegraph\n"
        "before = set(sys.modules)\n"
        "nodegraph.load\n"
        "print(json.dumps(['nodegraph.scripting' in before, 'nodegraph.scripting' in sys.modules]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [False, True]
