"""Workspaces hold only what differs from the defaults, so a default may not change silently.

``catalogue.json`` remembers each processor's version, defaults, and names. A change that breaks saved workspaces must
raise ``version`` (with ``migrate``), and a renamed processor must list its old id in ``formerly``. Then, or after
something was added, write the snapshot anew: ``python -m tests.contract.test_snapshot``.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from nodegraph import locations
from nodegraph.registry import Registry

FILE = Path(__file__).with_name("catalogue.json")
CURE = "python -m tests.contract.test_snapshot"

Snapshot = dict[str, dict[str, Any]]


def present() -> Snapshot:
    """What matters to a saved workspace, of every built-in processor as it is now."""
    registry = Registry([locations.built_in()])
    return {
        id: {
            "version": processor.version,
            "formerly": list(processor.formerly),
            "inputs": {name: port["type"] for name, port in processor.describe()["inputs"].items()},
            "outputs": {name: port["type"] for name, port in processor.describe()["outputs"].items()},
            "defaults": {
                name: {"kind": parameter.kind, "default": parameter.encode(parameter.default)}
                for name, parameter in processor.params.items()
            },
        }
        for id in registry.ids()
        for processor in [registry.find(id)]
    }


def breaks(before: Snapshot, now: Snapshot) -> list[str]:
    """What a workspace that was saved before would silently lose or read differently now."""
    found = []
    successors = {old: id for id, entry in now.items() for old in entry["formerly"]}
    for id, entry in before.items():
        new = now.get(id) or now.get(successors.get(id, ""))
        if new is None:
            found.append(f"{id}: is gone; list the old id in formerly of its successor")
            continue
        if new["version"] > entry["version"]:
            continue
        if new["version"] < entry["version"]:
            found.append(f"{id}: its version fell from {entry['version']} to {new['version']}")
        for part in ("inputs", "outputs", "defaults"):
            for name, value in entry[part].items():
                if name not in new[part]:
                    found.append(f"{id}.{name}: is gone from {part}; raise version and add migrate")
                elif new[part][name] != value:
                    found.append(f"{id}.{name}: {value} became {new[part][name]}; raise version and add migrate")
    return found


@pytest.fixture(scope="module")
def now() -> Snapshot:
    return json.loads(json.dumps(present()))  # type: ignore[no-any-return]


def test_nothing_that_workspaces_rely_on_changed_silently(now: Snapshot) -> None:
    assert breaks(json.loads(FILE.read_text("utf-8")), now) == []


def test_the_snapshot_is_complete(now: Snapshot) -> None:
    assert json.loads(FILE.read_text("utf-8")) == now, f"write the snapshot anew: {CURE}"


def test_what_breaks_workspaces_is_found() -> None:
    step = {"kind": "Float", "default": 0.5}
    entry = {"version": 1, "formerly": [], "inputs": {"volume": "Volume"}, "outputs": {}, "defaults": {"step": step}}
    before = {"a.b": entry}
    assert breaks(before, {"a.b": entry}) == []
    assert breaks(before, {"a.b": {**entry, "defaults": {"step": step, "new": step}}}) == []
    assert "raise version" in breaks(before, {"a.b": {**entry, "defaults": {"step": {**step, "default": 1.0}}}})[0]
    assert "is gone from inputs" in breaks(before, {"a.b": {**entry, "inputs": {}}})[0]
    assert breaks(before, {"a.b": {**entry, "version": 2, "inputs": {}}}) == []
    assert "formerly" in breaks(before, {})[0]
    assert breaks(before, {"c.d": {**entry, "formerly": ["a.b"]}}) == []
    assert "fell from" in breaks({"a.b": {**entry, "version": 3}}, {"a.b": entry})[0]


if __name__ == "__main__":
    FILE.write_text(json.dumps(present(), indent=1) + "\n", "utf-8")
    print(f"wrote {FILE}")
