"""Every built-in processor keeps to the contract: see nodegraph/testing/contract.py for what each check asks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from nodegraph import locations
from nodegraph.registry import Registry
from nodegraph.testing import Bench, Check, contract, heavy_imports

if TYPE_CHECKING:
    from nodegraph.compute import Devices

REGISTRY = Registry([locations.built_in()])
UNAVAILABLE = {entry["id"]: entry["unavailable"] for entry in REGISTRY.catalogue() if "unavailable" in entry}
PROCESSORS = [REGISTRY.find(id) for id in REGISTRY.ids() if id not in UNAVAILABLE]
CHECKS = [check for processor in PROCESSORS for check in contract(processor, imports=False)]


@pytest.fixture(scope="module")
def bench(devices: Devices) -> Bench:
    return Bench(devices)


def test_every_processor_loads() -> None:
    assert UNAVAILABLE == {}
    assert len(PROCESSORS) >= 12


@pytest.mark.parametrize("check", CHECKS, ids=str)
def test_contract(check: Check, bench: Bench) -> None:
    check(bench)


def test_no_import_loads_a_device_a_format_or_a_user_interface() -> None:
    assert heavy_imports(PROCESSORS) == {}
