"""Tests that a plug-in author runs on their own processors.

`contract` gives the checks that every processor keeps to, `Bench` calls a processor as the engine would.
"""

from nodegraph.testing.bench import Bench, default_bench
from nodegraph.testing.contract import (
    Check,
    ContractError,
    call,
    contract,
    heavy_imports,
    processor_of,
    processors_of,
    verify,
)

__all__ = [
    "Bench",
    "Check",
    "ContractError",
    "call",
    "contract",
    "default_bench",
    "heavy_imports",
    "processor_of",
    "processors_of",
    "verify",
]
