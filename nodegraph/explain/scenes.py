"""What a scene required: which nodes ran and why, the features of the kernels that made it, seconds and bytes.

A processor chooses the variants of its kernels while it runs, so this evaluates the views and then tells what was run.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from nodegraph.cache import blocks
from nodegraph.data import Buffer
from nodegraph.explain.fate import LastRun, asked, fate, running_places
from nodegraph.explain.scene_text import scene_text
from nodegraph.report import Report
from nodegraph.requests import default_sinks

if TYPE_CHECKING:
    from nodegraph.compute.dispatch import KernelRun
    from nodegraph.compute.language import Switch
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from nodegraph.plan import Plan
    from nodegraph.processor import Processor
    from nodegraph.report import Observer


@dataclass(slots=True)
class SceneKernel:
    """Equal runs of a kernel, and its switches as that variant has them."""

    run: KernelRun
    switches: tuple[Switch, ...]


@dataclass(slots=True)
class SceneMemo:
    """An intermediate that a node keeps by `memo`. ``made`` tells whether it was made now; ``seconds`` what it took."""

    name: str
    made: bool
    seconds: float | None
    bytes: int


@dataclass(slots=True)
class SceneNode:
    """What one node did for the scene.

    ``asked`` says who wanted it and at which size, ``reason`` why it ran or did not, ``decisions`` what it says of its
    own choices. ``host`` are bytes of its results on the host; ``device`` bytes that were brought to a device for it
    and are still there, by purpose. What two nodes share counts for the one that had it first.
    """

    path: str
    asked: str
    reason: str
    state: str = "clean"
    ran: bool = False
    seconds: float | None = None
    kernels: list[SceneKernel] = field(default_factory=list)
    memos: list[SceneMemo] = field(default_factory=list)
    decisions: list[str] = field(default_factory=list)
    host: int = 0
    device: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True)
class Scene:
    """What a scene required. ``idle`` holds the nodes that had no part in it, and why; ``str()`` is the whole as text.

    ``shared`` are bytes that a device holds for no node in particular, by purpose.
    """

    sinks: tuple[str, ...]
    device: str
    nodes: dict[str, SceneNode]
    idle: dict[str, str]
    shared: dict[str, int]
    report: Report

    def __str__(self) -> str:
        return scene_text(self)


def scene(
    engine: Engine,
    network: Network,
    sinks: Iterable[str] | str | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
    on_event: Observer | None = None,
) -> Scene:
    """Evaluate the sinks, all views without any, and tell what that required. Failures of nodes are in ``report``.

    An effect runs only where it is named: who wants an explanation does not want a file.
    Results that were kept are not made again; of those the kernels that once made them are told.
    Raises CommandError for an unknown sink, DeviceError when the chosen device is not there.
    """
    if sinks is None:
        flat = network.flatten()
        sinks = [path for path in default_sinks(flat) if not _is_effect(flat.nodes[path].processor)]
    plan = engine.plan(network, sinks, size=size, quality=quality)
    running = running_places(engine, plan)
    before = engine.last(network)
    nodes: dict[str, SceneNode] = {}
    for place, task in enumerate(plan.tasks):
        wanted, reason = asked(task), fate(engine, plan, place, running, before)
        node = nodes.setdefault(task.path, SceneNode(task.path, wanted, reason))
        # One node may be asked for several sizes.
        if wanted not in node.asked:
            node.asked += f"; {wanted}"
        if reason not in node.reason:
            node.reason += f"; {reason}"
    report = engine.evaluate(network, sinks, size=size, quality=quality, on_event=on_event)
    _fill(nodes, report, _making(engine, plan, report), engine.last(network))
    _count_host(engine, plan, nodes)
    shared = _count_device(engine, nodes)
    device = (engine.device_in_use or {}).get("reason", "")
    return Scene(tuple(plan.sinks), device, nodes, _idle(plan, nodes), shared, report)


def _fill(nodes: dict[str, SceneNode], report: Report, making: Report, last: LastRun) -> None:
    ran = set(report.ran)
    for path, node in nodes.items():
        state = report.states.get(path)
        node.state = str(state or "clean")
        if node.state in ("failed", "blocked"):
            node.reason = f"{node.state}: {getattr(state, 'reason', '')}"
        node.ran = path in ran
        node.seconds = report.timings.get(path)
        node.kernels = _kernels(making.kernels.get(path, []))
        node.decisions = list(making.decisions.get(path, ()))
        for label in making.memos.get(path, ()):
            name = label.removeprefix(f"{path}/")
            node.memos.append(SceneMemo(name, label in ran, last.seconds.get(label), last.bytes.get(label, 0)))


def _making(engine: Engine, plan: Plan, report: Report) -> Report:
    """How the results were made. Those that are kept tell it, also where nobody had to look at them now."""
    making = Report()
    lost = {task.path for task in plan.tasks if task.fingerprint not in engine.cache}
    for task in plan.tasks:
        result = engine.cache.get(task.fingerprint)
        if result is not None and task.path not in lost:
            making.add_making(task.path, result)
    return replace(
        report,
        kernels={**report.kernels, **making.kernels},
        decisions={**report.decisions, **making.decisions},
        memos={**report.memos, **making.memos},
    )


def _kernels(runs: list[KernelRun]) -> list[SceneKernel]:
    from nodegraph.compute.dispatch import merged
    from nodegraph.compute.language import switches

    return [SceneKernel(run, switches(run.source, run.defines)) for run in merged(runs)]


def _count_host(engine: Engine, plan: Plan, nodes: dict[str, SceneNode]) -> None:
    seen: set[int] = set()
    for task in plan.tasks:
        result = engine.cache.get(task.fingerprint)
        for identity, nbytes, owner in blocks(result.values) if result is not None else ():
            if identity not in seen and (not isinstance(owner, Buffer) or owner.on_host):
                seen.add(identity)
                nodes[task.path].host += nbytes


def _count_device(engine: Engine, nodes: dict[str, SceneNode]) -> dict[str, int]:
    """Fill in what lies on devices for each node; return what lies there for none of them."""

    def look() -> list[dict[str, dict[str, int]]]:
        found = []
        for device in engine.devices.opened:
            device.require_thread()
            device.memory.drain()
            found.append(device.memory.by_node())
        return found

    shared: dict[str, int] = {}
    for totals in engine.call(look):
        for path, purposes in totals.items():
            into = nodes[path].device if path in nodes else shared
            for purpose, nbytes in purposes.items():
                if nbytes:
                    into[purpose] = into.get(purpose, 0) + nbytes
    return shared


def _is_effect(processor: type[Processor] | None) -> bool:
    return processor is not None and processor.effect


def _idle(plan: Plan, nodes: dict[str, SceneNode]) -> dict[str, str]:
    idle = {path: "nothing that is shown reads it" for path in plan.flat.nodes if path not in nodes}
    return idle | dict.fromkeys(plan.flat.muted, "muted")
