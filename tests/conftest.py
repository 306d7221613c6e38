"""Devices and engines for every test.

A test that takes ``gl``, ``cl``, ``cl64`` or ``device`` (each of the three in turn) **fails** where that device is
missing: a test that is skipped proves nothing, and both kinds of device come with `make test`.
"""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from nodegraph.compute import Devices
    from nodegraph.engine import Engine

ROOT = Path(__file__).resolve().parent.parent
DEVICE_NAMES = ("gl", "cl", "cl64")

# A shell has its background jobs ignore Ctrl-C, and so would what tests interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Thousands of tests are collected and none is dropped: looking for garbage among them would only take time."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What needs OpenCL is slow: its kernels are compiled anew for every variant, and OpenGL's show most faults."""
    for item in items:
        chosen = getattr(getattr(item, "callspec", None), "params", {})
        needed = {*getattr(item, "fixturenames", ()), *(value for value in chosen.values() if isinstance(value, str))}
        if needed & {"cl", "cl64"}:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session", autouse=True)
def private_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Keep what tests leave on disk out of the user's cache folder, and the user's plug-ins out of the tests."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NODEGRAPH_CACHE", str(folder))
        patch.delenv("NODEGRAPH_PATH", raising=False)
        yield folder


@pytest.fixture(scope="session")
def root() -> Path:
    """The top of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def devices() -> Iterator[Devices]:
    """The devices of this process, opened on the thread of the tests when first asked for."""
    from nodegraph.compute import Devices

    opened = Devices()
    yield opened
    opened.close()


def _open(devices: Devices, name: str) -> Any:
    from nodegraph.errors import DeviceError

    try:
        device, _reason = devices.choose(name)
    except DeviceError as error:
        pytest.fail(f"this test needs the device {name!r}: {error}", pytrace=False)
    return device


@pytest.fixture(scope="session")
def gl(devices: Devices) -> Any:
    """OpenGL."""
    return _open(devices, "gl")


@pytest.fixture(scope="session")
def cl(devices: Devices) -> Any:
    """OpenCL in single precision."""
    return _open(devices, "cl")


@pytest.fixture(scope="session")
def cl64(devices: Devices) -> Any:
    """OpenCL in double precision."""
    return _open(devices, "cl64")


@pytest.fixture(scope="session", params=DEVICE_NAMES)
def device(request: pytest.FixtureRequest, devices: Devices) -> Any:
    """Each of the three devices in turn."""
    return _open(devices, request.param)


@pytest.fixture(scope="session")
def _engines() -> Iterator[Callable[[str], Engine]]:
    """One engine for each device name, kept for the whole session: opening a device costs more than most tests."""
    from nodegraph.engine import Engine

    opened: dict[str, Engine] = {}

    def engine_for(name: str) -> Engine:
        if name not in opened:
            opened[name] = Engine(device=name, disk=False)
        return opened[name]

    yield engine_for
    for engine in opened.values():
        engine.close()


@pytest.fixture
def engine(_engines: Callable[[str], Engine]) -> Engine:
    """An engine on the device that `auto` chooses, shared by the session; results may already be cached."""
    return _engines("auto")


@pytest.fixture(params=DEVICE_NAMES)
def engine_on_each(request: pytest.FixtureRequest, _engines: Callable[[str], Engine]) -> Engine:
    """An engine on each of the three devices in turn."""
    return _engines(request.param)


@pytest.fixture
def rng() -> np.random.Generator:
    """The same random numbers in every run."""
    return np.random.default_rng(20260)


@pytest.fixture(autouse=True)
def _same_folder() -> Iterator[None]:
    """No test may leave the process in another folder."""
    before = Path.cwd()
    yield
    after = Path.cwd()
    os.chdir(before)
    assert after == before, f"this test left the process in {after}"
