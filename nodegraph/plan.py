"""Work out what has to run: requests go up from the sinks, fingerprints come down.

Planning runs no processor and reads no data. The same plan is what the scheduler runs and what `explain`
prints. A `Planner` belongs to one network and remembers its last answers, so that a plan after one change
hashes only what changed and what stands below it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nodegraph.errors import GraphError
from nodegraph.fingerprint import SIZE, Code, Local, code_of, digest, file_state, given_key, local_of
from nodegraph.requests import (
    Feed,
    Request,
    Skeleton,
    Step,
    ask_needs,
    build,
    coarseness,
    default_sinks,
    level,
    same_answer,
    sink_size,
)

__all__ = ["Plan", "Planner", "Request", "Task", "default_sinks", "plan"]

if TYPE_CHECKING:
    from nodegraph.flat import Flat, FlatNode
    from nodegraph.processor import Processor


@dataclass(slots=True, eq=False)
class Task:
    """One node, run for one request.

    ``feeds`` gives for each input and each wired parameter the tasks that it comes from, in wire order, or
    None where ``needs`` cut the branch. ``request`` is None where no size and no quality can matter.
    ``problem`` says why the task cannot run whatever its inputs bring. ``stable`` is False below a value that
    a script brought: another process cannot make the same fingerprint.
    """

    path: str
    node: FlatNode
    request: Request | None
    wanted: frozenset[str]
    feeds: Mapping[str, tuple[Feed, ...] | None]
    fingerprint: bytes
    local: Local
    reason: str
    services: tuple[str, ...]
    problem: GraphError | None
    stable: bool
    upstream: tuple[bytes, ...] = field(repr=False)

    @property
    def processor(self) -> type[Processor] | None:
        return self.node.processor

    @property
    def size(self) -> tuple[int, int] | None:
        return self.request.size if self.request else None

    @property
    def quality(self) -> str | None:
        return self.request.quality if self.request else None

    @property
    def on_device(self) -> bool:
        """True when the task must run on the engine's thread."""
        processor = self.node.processor
        return processor is not None and ("device" in processor.services or "gl" in processor.services)


@dataclass(slots=True)
class Plan:
    """Tasks in execution order: each stands after all that feed it.

    ``sinks`` holds for each sink as it was named the feeds that it stands for. ``given`` holds the values
    that a script brought, by the path of the node that stands for them. ``named`` holds the paths of the
    sinks: an effect runs only when it is among them.
    """

    tasks: list[Task]
    sinks: dict[str, tuple[Feed, ...]]
    flat: Flat
    given: Mapping[str, Any]
    named: frozenset[str]


class Planner:
    """Plans of one network. ``device`` returns the name of the device, and is asked only when a task names it."""

    def __init__(self, device: Callable[[], str] = lambda: "gl") -> None:
        self._device = device
        self._locals: dict[str, tuple[FlatNode, Local]] = {}
        self._with_files: set[str] = set()
        self._codes: dict[type[Processor], Code] = {}
        self._skeletons: dict[Any, Skeleton] = {}

    def plan(
        self,
        flat: Flat,
        sinks: Iterable[str] | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        given: Mapping[str, Any] | None = None,
    ) -> Plan:
        """Plan for some sinks (``"node"`` or ``"node.output"``), or for all views and effects.

        ``size`` overrides the sizes of the sinks. Raises CommandError for a sink that does not exist.
        """
        given = given or {}
        quality = level(coarseness(quality))
        named = tuple(dict.fromkeys(default_sinks(flat) if sinks is None else sinks))
        self._refresh(flat, given)
        requests = tuple(Request(sink_size(flat, sink, size), quality) for sink in named)
        skeleton = self._skeleton(flat, named, requests)
        tasks = self._tasks(flat, skeleton, given)
        paths = frozenset(tasks[i].path for feeds in skeleton.sinks.values() for i, _ in feeds)
        return Plan(tasks, skeleton.sinks, flat, given, paths)

    def _refresh(self, flat: Flat, given: Mapping[str, Any]) -> None:
        """Bring the local parts up to date; where a class was replaced, forget the skeletons built with it."""
        known = self._locals
        for processor in [processor for processor in self._codes if processor.kernels]:
            if code_of(processor).digest != self._codes[processor].digest:
                del self._codes[processor]
                self._locals = known = {p: kept for p, kept in known.items() if kept[0].processor is not processor}
        for path, node in flat.nodes.items():
            kept = known.get(path)
            if kept is None:
                self._skeletons.clear()
                self._learn(path, node, given)
            elif kept[0] is not node and kept[0].revision != node.revision:
                if kept[0].processor is not node.processor or kept[0].wired != node.wired:
                    self._skeletons.clear()
                self._learn(path, node, given)
        for path in self._with_files & flat.nodes.keys():
            node, local = known[path]
            if any(file_state(node.values[name]) != state for name, state in local.files.items()):
                self._learn(path, node, given)
        if len(known) > 2 * len(flat.nodes) + 100:
            self._locals = {path: kept for path, kept in known.items() if path in flat.nodes}
            self._with_files &= self._locals.keys()

    def _learn(self, path: str, node: FlatNode, given: Mapping[str, Any]) -> None:
        processor = node.processor
        if path in given:
            key = given_key(given[path])
            local = Local(key, Code(key, (("given by the script", key.hex()[:16]),)), {}, {})
        elif processor is None:
            # Its values cannot be encoded without a declaration, and it does not run.
            code = Code(digest("unknown", node.type), (("type", node.type),))
            local = Local(code.digest, code, {}, {})
        else:
            code = self._codes.get(processor) or self._codes.setdefault(processor, code_of(processor))
            try:
                local = local_of(node, code)
            except GraphError as error:
                local = Local(digest(code.digest, "refused", str(error)), code, {"problem": str(error)}, {})
        (self._with_files.add if local.files else self._with_files.discard)(path)
        self._locals[path] = (node, local)

    def _skeleton(self, flat: Flat, named: tuple[str, ...], requests: tuple[Request, ...]) -> Skeleton:
        key = (named, requests)
        kept = self._skeletons.get(key)
        if kept is not None and kept.structure == flat.structure:
            for path, request, wanted, answer in kept.answers:
                if not same_answer(ask_needs(flat.nodes[path], request, wanted), answer):
                    break
            else:
                return kept
        if len(self._skeletons) > 16:
            self._skeletons.clear()
        skeleton = self._skeletons[key] = build(flat, named, requests)
        return skeleton

    def _tasks(self, flat: Flat, skeleton: Skeleton, given: Mapping[str, Any]) -> list[Task]:
        tasks: list[Task] = []
        blake2b, known, nodes = hashlib.blake2b, self._locals, flat.nodes
        for step in skeleton.steps:
            path = step.path
            node, local, old = nodes[path], known[path][1], step.task
            upstream = tuple([tasks[i].fingerprint for i in step.order])
            services = self._services(node.processor, step)
            if old is not None and old.local is local and old.upstream == upstream and old.services == services:
                if old.node is not node:
                    old = _copy(old, node)
                    step.task = old
                tasks.append(old)
                continue
            if path in given:
                fingerprint = local.digest
            else:
                text = b"".join((local.digest, step.head, *upstream, *(service.encode() for service in services)))
                fingerprint = blake2b(text, digest_size=SIZE).digest()
            stable = path not in given and all(tasks[i].stable for i in step.order)
            problem = None if path in given else node.problem or step.problem
            task = Task(
                path, node, step.request, step.wanted, step.feeds, fingerprint, local, step.reason, services,
                problem, stable, upstream,
            )  # fmt: skip
            step.task = task
            tasks.append(task)
        return tasks

    def _services(self, processor: type[Processor] | None, step: Step) -> tuple[str, ...]:
        """Those services that may change the result, where ``process`` names them."""
        if processor is None or not processor.services:
            return ()
        named = processor.services
        found = []
        if step.request is not None:
            if "size" in named:
                found.append(f"size {step.request.size[0]}x{step.request.size[1]}\0")
            if "quality" in named:
                found.append(f"quality {step.request.quality}\0")
        if "wanted" in named:
            found.append(f"wanted {' '.join(sorted(step.wanted))}\0")
        if "device" in named:
            found.append(f"device {self._device()}\0")
        if "gl" in named:
            found.append("device gl\0")
        return tuple(found)


def plan(
    flat: Flat,
    sinks: Iterable[str] | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
    device: Callable[[], str] = lambda: "gl",
    given: Mapping[str, Any] | None = None,
) -> Plan:
    """Plan once, remembering nothing; see `Planner.plan`."""
    return Planner(device).plan(flat, sinks, size=size, quality=quality, given=given)


def _copy(task: Task, node: FlatNode) -> Task:
    """The same task on a newer snapshot of its node."""
    return Task(
        task.path, node, task.request, task.wanted, task.feeds, task.fingerprint, task.local, task.reason,
        task.services, node.problem or task.problem, task.stable, task.upstream,
    )  # fmt: skip
