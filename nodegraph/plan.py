"""Work out what has to run: requests go up from the sinks, fingerprints come down.

Planning runs no processor and reads no data. The same plan is what the scheduler runs and what `explain`
prints. A `Planner` belongs to one network and remembers its last answers, so that a plan after one change
hashes only what changed and what stands below it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from nodegraph.data import Value
from nodegraph.errors import CommandError, GraphError, ParameterError, PortError, ProcessError, near_miss
from nodegraph.fingerprint import SIZE, Code, Local, code_of, digest, file_state, local_of

if TYPE_CHECKING:
    from nodegraph.flat import Flat, FlatNode
    from nodegraph.processor import Processor

DEFAULT_SIZE = (1024, 1024)
QUALITIES = ("interactive", "final")


class Request(NamedTuple):
    """What is asked of a node: a picture size (width, height) in pixels and a quality."""

    size: tuple[int, int]
    quality: str = "final"


Feed = tuple[int, str]
"""Position of a task in its plan, and the name of one of its outputs."""


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
    given: Mapping[str, Value]
    named: frozenset[str]


@dataclass(slots=True)
class _Step:
    """A task without its fingerprint: where it stands and what it is asked for."""

    path: str
    request: Request | None
    wanted: frozenset[str]
    feeds: dict[str, tuple[Feed, ...] | None]
    reason: str
    problem: GraphError | None
    order: tuple[int, ...]
    head: bytes
    task: Task | None = None


@dataclass(slots=True)
class _Skeleton:
    """Steps for one set of sinks, valid while the structure and the answers of ``needs`` stay the same."""

    structure: int
    steps: list[_Step]
    sinks: dict[str, tuple[Feed, ...]]
    answers: list[tuple[str, Request, frozenset[str], Any]]


class Planner:
    """Plans of one network. ``device`` returns the name of the device, and is asked only when a task names it."""

    def __init__(self, device: Callable[[], str] = lambda: "gl") -> None:
        self._device = device
        self._locals: dict[str, tuple[FlatNode, Local]] = {}
        self._with_files: set[str] = set()
        self._codes: dict[type[Processor], Code] = {}
        self._skeletons: dict[Any, _Skeleton] = {}

    def plan(
        self,
        flat: Flat,
        sinks: Iterable[str] | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        given: Mapping[str, Value] | None = None,
    ) -> Plan:
        """Plan for some sinks (``"node"`` or ``"node.output"``), or for all views and effects.

        ``size`` overrides the sizes of the sinks. Raises CommandError for a sink that does not exist.
        """
        given = given or {}
        if quality not in QUALITIES:
            raise ParameterError(f"quality: expected one of {', '.join(QUALITIES)}, got {quality!r}")
        named = tuple(dict.fromkeys(default_sinks(flat) if sinks is None else sinks))
        self._refresh(flat, given)
        requests = tuple(Request(sink_size(flat, sink, size), quality) for sink in named)
        skeleton = self._skeleton(flat, named, requests)
        tasks = self._tasks(flat, skeleton, given)
        paths = frozenset(tasks[i].path for feeds in skeleton.sinks.values() for i, _ in feeds)
        return Plan(tasks, skeleton.sinks, flat, given, paths)

    def _refresh(self, flat: Flat, given: Mapping[str, Value]) -> None:
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

    def _learn(self, path: str, node: FlatNode, given: Mapping[str, Value]) -> None:
        processor = node.processor
        if path in given:
            key = given[path].provenance
            assert key is not None
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

    def _skeleton(self, flat: Flat, named: tuple[str, ...], requests: tuple[Request, ...]) -> _Skeleton:
        key = (named, requests)
        kept = self._skeletons.get(key)
        if kept is not None and kept.structure == flat.structure:
            for path, request, wanted, answer in kept.answers:
                if not _same(_ask(flat.nodes[path], request, wanted), answer):
                    break
            else:
                return kept
        if len(self._skeletons) > 16:
            self._skeletons.clear()
        skeleton = self._skeletons[key] = _build(flat, named, requests)
        return skeleton

    def _tasks(self, flat: Flat, skeleton: _Skeleton, given: Mapping[str, Value]) -> list[Task]:
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

    def _services(self, processor: type[Processor] | None, step: _Step) -> tuple[str, ...]:
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
    given: Mapping[str, Value] | None = None,
) -> Plan:
    """Plan once, remembering nothing; see `Planner.plan`."""
    return Planner(device).plan(flat, sinks, size=size, quality=quality, given=given)


def default_sinks(flat: Flat) -> list[str]:
    """All views and effects: what a headless run shows and writes. Where there are none, every node nobody reads."""
    found = [path for path, node in flat.nodes.items() if is_output(node)]
    if found:
        return found
    read = {source[0] for node in flat.nodes.values() for sources in node.sources.values() for source in sources}
    read |= {source[0] for node in flat.nodes.values() for source in node.wired.values()}
    return [path for path in flat.nodes if path not in read]


def is_output(node: FlatNode) -> bool:
    """True for views and for what changes the world."""
    effect = node.processor is not None and node.processor.effect
    return effect or node.type.rpartition(".")[0].split(".")[0] == "output"


def sink_size(flat: Flat, sink: str, asked: tuple[int, int] | None = None) -> tuple[int, int]:
    """Size that a sink asks for: the caller's, else its own ``width`` and ``height`` or ``size``, else 1024 x 1024."""
    if asked is not None:
        width, height = asked
        return int(width), int(height)
    node = flat.nodes.get(sink) or flat.nodes.get(sink.rpartition(".")[0])
    values = node.values if node is not None else {}
    if "width" in values and "height" in values:
        return int(values["width"]), int(values["height"])
    own = values.get("size")
    if isinstance(own, Sequence) and not isinstance(own, str) and len(own) == 2:
        return int(own[0]), int(own[1])
    return DEFAULT_SIZE


def _sources_of(flat: Flat, sink: str) -> list[tuple[str, frozenset[str]]]:
    """Nodes and outputs that the name of a sink stands for, through muted nodes and groups."""
    node = flat.nodes.get(sink)
    if node is not None:
        outputs = node.processor.outputs if node.processor is not None else ()
        return [(sink, frozenset(outputs))]
    found = [flat.source(sink)] if flat.source(sink) is not None else []
    if not found:
        found = [source for name, source in flat.outputs.items() if name.rpartition(".")[0] == sink]
    result = []
    for source in found:
        if isinstance(source, GraphError):
            raise source
        if source is not None:
            path, output = source
            processor = flat.nodes[path].processor
            if processor is not None and output not in processor.outputs:
                cure = near_miss(output, processor.outputs)
                raise CommandError(f"{sink}: {path} has no output {output!r}{cure}")
            result.append((path, frozenset((output,))))
    if not result:
        if sink in flat.muted:
            raise CommandError(f"{sink}: this node is muted and passes nothing through; unmute it or name another")
        raise CommandError(f"{sink}: no such node{near_miss(sink, flat.nodes)}")
    return result


def _build(flat: Flat, named: tuple[str, ...], requests: tuple[Request, ...]) -> _Skeleton:
    """Send the requests up, then lay the steps out in order of execution."""
    sensitive = _sensitive(flat)
    asked: dict[str, dict[Request | None, tuple[set[str], list[str]]]] = {}

    def ask(path: str, request: Request, outputs: Iterable[str], by: str) -> None:
        key = request if path in sensitive else None
        wanted, readers = asked.setdefault(path, {}).setdefault(key, (set(), []))
        wanted.update(outputs)
        if by not in readers:
            readers.append(by)

    stands_for: dict[str, list[tuple[str, Request, frozenset[str]]]] = {}
    for sink, request in zip(named, requests, strict=True):
        for path, outputs in _sources_of(flat, sink):
            ask(path, request, outputs, "")
            stands_for.setdefault(sink, []).append((path, request, outputs))

    answers: list[tuple[str, Request, frozenset[str], Any]] = []
    chosen: dict[tuple[str, Request | None], tuple[dict[str, Request | None], GraphError | None]] = {}
    for path in reversed(list(flat.nodes)):
        node = flat.nodes[path]
        for key, (wanted, _) in asked.get(path, {}).items():
            request = key or requests[0]
            inputs, problem = _requests(node, request, frozenset(wanted), answers)
            chosen[path, key] = (inputs, problem)
            for port, upward in inputs.items():
                for source, output in _ports(node)[port]:
                    if upward is not None:
                        ask(source, upward, (output,), path)

    steps: list[_Step] = []
    places: dict[tuple[str, Request | None], int] = {}
    for path, node in flat.nodes.items():
        for key, (wanted, readers) in asked.get(path, {}).items():
            inputs, problem = chosen[path, key]
            feeds: dict[str, tuple[Feed, ...] | None] = {}
            order: list[int] = []
            head = bytearray()
            for port, upward in inputs.items():
                if upward is None:
                    feeds[port] = None
                    head += f"{port}\0cut\0".encode()
                    continue
                feeds[port] = tuple(
                    (places[source, upward if source in sensitive else None], output)
                    for source, output in _ports(node)[port]
                )
                order += [place for place, _ in feeds[port] or ()]
                head += f"{port}\0{' '.join(output for _, output in feeds[port] or ())}\0".encode()
            places[path, key] = len(steps)
            reason = "sink" if "" in readers else "asked by " + ", ".join(readers)
            # The length in front keeps names of ports apart from the digests that follow them.
            labels = len(head).to_bytes(4, "little") + bytes(head)
            steps.append(_Step(path, key, frozenset(wanted), feeds, reason, problem, tuple(order), labels))

    sinks: dict[str, tuple[Feed, ...]] = {}
    for sink, targets in stands_for.items():
        found: list[Feed] = []
        for path, request, outputs in targets:
            place = places[path, request if path in sensitive else None]
            processor = flat.nodes[path].processor
            ordered = [name for name in processor.outputs if name in outputs] if processor is not None else []
            found += [(place, output) for output in ordered] or [(place, "")]
        sinks[sink] = tuple(found)
    return _Skeleton(flat.structure, steps, sinks, answers)


def _ports(node: FlatNode) -> dict[str, tuple[tuple[str, str], ...]]:
    """Everything of a node that a wire may feed: inputs, then parameters that are wired."""
    return {**node.sources, **{name: (source,) for name, source in node.wired.items()}}


def _sensitive(flat: Flat) -> set[str]:
    """Nodes whose result may depend on size or quality: they, or something above them, can tell."""
    found: set[str] = set()
    for path, node in flat.nodes.items():
        processor = node.processor
        if processor is not None and ("size" in processor.services or "quality" in processor.services):
            found.add(path)
        elif (processor is not None and processor.has_needs) or any(
            source in found for sources in _ports(node).values() for source, _ in sources
        ):
            found.add(path)
    return found


class _Unknown(Exception):
    """``needs`` read a parameter whose value only a wire will bring."""


class _Params(dict[str, Any]):
    """Visible parameters for ``needs``; reading a wired one raises `_Unknown`."""

    def __init__(self, node: FlatNode) -> None:
        super().__init__(node.values)
        self._wired = node.wired

    def __missing__(self, name: str) -> Any:
        raise _Unknown(name) if name in self._wired else KeyError(name)

    def get(self, name: str, default: Any = None) -> Any:
        return self[name] if name in self or name in self._wired else default


def _ask(node: FlatNode, request: Request, wanted: frozenset[str]) -> Any:
    """Call ``needs``. An error is an answer too: it blocks the node."""
    processor: Any = node.processor
    if node.problem is not None:
        return {}
    try:
        return processor().needs(request.size, request.quality, wanted, _Params(node))
    except _Unknown:
        return {}
    except Exception as error:
        return ProcessError(node.path, "needs", error)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, GraphError):
        return isinstance(other, GraphError) and str(one) == str(other)
    return bool(one == other)


def _requests(
    node: FlatNode,
    request: Request,
    wanted: frozenset[str],
    answers: list[tuple[str, Request, frozenset[str], Any]],
) -> tuple[dict[str, Request | None], GraphError | None]:
    """What a node asks of each port that is wired: a request, or None for a branch that does not run."""
    ports: dict[str, Request | None] = {name: request for name, sources in _ports(node).items() if sources}
    if node.processor is None or not node.processor.has_needs:
        return ports, None
    answer = _ask(node, request, wanted)
    answers.append((node.path, request, wanted, answer))
    if isinstance(answer, GraphError):
        return {}, answer
    try:
        for name, need in (answer or {}).items():
            if name not in node.sources and name not in node.processor.params:
                raise PortError(f"{node.path}.{name}: needs() names an input that is not declared")
            if name in ports:
                ports[name] = _need(need, request, f"{node.path}.{name}")
    except (AttributeError, TypeError, ValueError) as error:
        return {}, ProcessError(node.path, "needs", error)
    return ports, None


def _need(need: Any, request: Request, where: str) -> Request | None:
    if need is None or isinstance(need, Request):
        return need
    if isinstance(need, Sequence) and len(need) == 2 and all(isinstance(n, int) and n >= 0 for n in need):
        return Request((need[0], need[1]), request.quality)
    raise PortError(f"{where}: needs() must answer None, (width, height) or a Request, got {need!r}")


def _copy(task: Task, node: FlatNode) -> Task:
    """The same task on a newer snapshot of its node."""
    return Task(
        task.path, node, task.request, task.wanted, task.feeds, task.fingerprint, task.local, task.reason,
        task.services, node.problem or task.problem, task.stable, task.upstream,
    )  # fmt: skip
