"""The generated JSON Schema of workspaces."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from nodegraph.schema import workspace_schema
from nodegraph.workspace import dumps
from tests.support.document import KIT, chain

SHIPPED = sorted((Path(__file__).resolve().parents[2] / "workspaces").glob("*.json"))


@pytest.fixture(scope="module")
def kit() -> Any:
    schema = workspace_schema(KIT.values())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.fixture(scope="module")
def built_in() -> Any:
    schema = workspace_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_what_is_written_is_valid(kit: Any) -> None:
    net = chain()
    net["raycast"].quality_limit = float("nan")
    net["raycast"].up = (0.0, 1.0, 0.0)
    net.link("raycast.camera", "camera")
    net.add("compose")
    net.connect("raycast.image", "compose.images")
    net.group("blur", "raycast", id="finish")
    kit.validate(json.loads(dumps(net)))


@pytest.mark.parametrize(
    ("node", "valid"),
    [
        ({"type": "blur", "params": {"sigma": 2}}, True),
        ({"type": "blur", "params": {"sigma": 20}}, False),
        ({"type": "blur", "params": {"sigma": "2"}}, False),
        ({"type": "blur", "params": {"sgima": 2}}, False),
        ({"type": "blur", "params": {"mode": "sideways"}}, False),
        ({"type": "blur", "version": 1, "params": {"variance": 2}}, True),
        ({"type": "blur", "inputs": {"volume": "ct.volume", "sigma": "fly.amount"}}, True),
        ({"type": "blur", "inputs": {"volume": ["ct.volume"]}}, False),
        ({"type": "blur", "inputs": {"mask": "ct.volume"}}, False),
        ({"type": "blur", "inputs": {"volume": "ct"}}, False),
        ({"type": "compose", "inputs": {"images": ["a.image", "b.image"]}}, True),
        ({"type": "blur", "links": {"sigma": "coarse"}}, True),
        ({"type": "blur", "links": {"volume": "coarse"}}, False),
        ({"type": "blur", "muted": 1}, False),
        ({"type": "not.here", "params": {"x": [1]}, "later": True}, True),
        ({"type": "group", "nodes": {"a": {"type": "blur", "params": {"sigma": -1}}}}, False),
        ({"type": "group", "nodes": {}, "expose": {"outputs": {"image": "a.image"}}}, True),
        ({}, False),
    ],
)
def test_nodes(kit: Any, node: dict[str, Any], valid: bool) -> None:
    assert kit.is_valid({"nodegraph": 1, "nodes": {"n": node}}) is valid


def test_the_whole(kit: Any) -> None:
    assert kit.is_valid({"nodegraph": 1, "variables": {"a": {"kind": "Float", "expression": "1 / 2"}}, "new": 1})
    assert not kit.is_valid({"nodegraph": 1, "variables": {"a": {"kind": "Float"}}})
    assert not kit.is_valid({"nodegraph": 2})
    assert not kit.is_valid({"nodegraph": 1, "nodes": {"a b": {"type": "blur"}}})
    assert not kit.is_valid({"nodes": {}})


def test_it_is_the_same_every_time() -> None:
    assert json.dumps(workspace_schema(KIT.values())) == json.dumps(workspace_schema(reversed(KIT.values())))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_workspace_is_valid(built_in: Any, path: Path) -> None:
    built_in.validate(json.loads(path.read_text("utf-8")))


def test_the_file_in_the_docs_is_current() -> None:
    from nodegraph import docs_pages

    path = Path(__file__).resolve().parents[2] / "docs" / docs_pages.SCHEMA
    assert path.read_text("utf-8") == docs_pages.pages()[docs_pages.SCHEMA], "write it anew with: nodegraph docs"
