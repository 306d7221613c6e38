"""Requests go up: from the sinks, each with a size and a quality, through what every processor says it needs.

The outcome is a `Skeleton`: the steps of a plan in order, without their fingerprints. It depends on the structure
of the network and on the answers of ``needs`` alone, so it outlives most changes of parameters.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from nodegraph.errors import (
    CommandError,
    GraphError,
    ParameterError,
    PortError,
    ProcessError,
    near_miss,
    near_miss_or_all,
)

if TYPE_CHECKING:
    from nodegraph.flat import Flat, FlatNode
    from nodegraph.plan import Task

DEFAULT_SIZE = (1024, 1024)
LEVELS = (2, 4, 8, 16, 32, 64)
INTERACTIVE = 4
QUALITIES = ("interactive", "final", *(f"interactive/{n}" for n in LEVELS))
"""What may be asked for; ``interactive`` alone is resolved to a level before anything is planned."""


def level(n: int) -> str:
    """The quality that asks for about one n-th of the work of final: ``final`` for 1, else ``interactive/n``."""
    return "final" if n == 1 else f"interactive/{n}"


def coarseness(quality: str) -> int:
    """The n of a quality, see `level`. Raises ParameterError for a word that is none."""
    if quality not in QUALITIES:
        raise ParameterError(f"quality: expected one of {', '.join(QUALITIES)}, got {quality!r}")
    return 1 if quality == "final" else int(quality.partition("/")[2] or INTERACTIVE)


def coarser(size: tuple[int, int], step: float | None, n: int) -> tuple[tuple[int, int], float | None]:
    """Size (w, h) and step, voxels, with about one n-th of the work. The step is None where there is none.

    Short steps grow up to a voxel; the rest is saved in pixels, which loses less than longer steps would.
    """
    if n == 1:
        return size, step
    growth = min(math.sqrt(n), max(1.0, 1.0 / step)) if step else 1.0
    height = max(1, round(size[1] / math.sqrt(n / growth)))
    return (math.ceil(size[0] * height / size[1]), height), step and step * growth


class Request(NamedTuple):
    """What is asked of a node: a picture size (width, height) in pixels and a quality."""

    size: tuple[int, int]
    quality: str = "final"


Feed = tuple[int, str]
"""Position of a task in its plan, and the name of one of its outputs."""


@dataclass(slots=True)
class Step:
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
class Skeleton:
    """Steps for one set of sinks, valid while the structure and the answers of ``needs`` stay the same."""

    structure: int
    steps: list[Step]
    sinks: dict[str, tuple[Feed, ...]]
    answers: list[tuple[str, Request, frozenset[str], Any]]


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
                cure = near_miss_or_all(output, processor.outputs)
                raise CommandError(f"{sink}: {path} has no output {output!r}{cure}")
            result.append((path, frozenset((output,))))
    if not result:
        if sink in flat.muted:
            raise CommandError(f"{sink}: this node is muted and passes nothing through; unmute it or name another")
        raise CommandError(f"{sink}: no such node{near_miss(sink, flat.nodes)}")
    return result


def build(flat: Flat, named: tuple[str, ...], requests: tuple[Request, ...]) -> Skeleton:
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

    steps: list[Step] = []
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
            steps.append(Step(path, key, frozenset(wanted), feeds, reason, problem, tuple(order), labels))

    sinks: dict[str, tuple[Feed, ...]] = {}
    for sink, targets in stands_for.items():
        found: list[Feed] = []
        for path, request, outputs in targets:
            place = places[path, request if path in sensitive else None]
            processor = flat.nodes[path].processor
            ordered = [name for name in processor.outputs if name in outputs] if processor is not None else []
            found += [(place, output) for output in ordered] or [(place, "")]
        sinks[sink] = tuple(found)
    return Skeleton(flat.structure, steps, sinks, answers)


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


def ask_needs(node: FlatNode, request: Request, wanted: frozenset[str]) -> Any:
    """Call ``needs``. An error is an answer too: it blocks the node."""
    processor: Any = node.processor
    if node.problem is not None:
        return {}
    try:
        return processor().needs(request.size, request.quality, wanted, _Params(node))
    except _Unknown:
        return {}
    except Exception as error:
        return ProcessError(node.path, "needs", error, processor.file)


def same_answer(one: Any, other: Any) -> bool:
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
    answer = ask_needs(node, request, wanted)
    answers.append((node.path, request, wanted, answer))
    if isinstance(answer, GraphError):
        return {}, answer
    try:
        if answer is not None and not isinstance(answer, Mapping):
            raise PortError(f"{node.path}: needs() must answer a dict of inputs, got {answer!r}")
        for name, need in (answer or {}).items():
            if name not in node.sources and name not in node.processor.params:
                raise PortError(f"{node.path}.{name}: needs() names an input that is not declared")
            if name in ports:
                ports[name] = _need(need, request, f"{node.path}.{name}")
    except (AttributeError, TypeError, ValueError) as error:
        return {}, ProcessError(node.path, "needs", error)
    return ports, None


def _need(need: Any, request: Request, where: str) -> Request | None:
    if need is None:
        return None
    if isinstance(need, Request):
        return Request(need.size, level(coarseness(need.quality)))
    if isinstance(need, Sequence) and len(need) == 2 and all(isinstance(n, int) and n >= 0 for n in need):
        return Request((need[0], need[1]), request.quality)
    raise PortError(f"{where}: needs() must answer None, (width, height) or a Request, got {need!r}")
