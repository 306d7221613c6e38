"""A scene as text, a paragraph for each node."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from nodegraph.explain.fate import counted

if TYPE_CHECKING:
    from nodegraph.explain.scenes import Scene, SceneKernel, SceneMemo, SceneNode

PURPOSES = {"input": "inputs", "output": "outputs", "program": "programs", "scratch": "scratch"}


def scene_text(scene: Scene) -> str:
    """The whole of a scene."""
    ran = sum(node.ran for node in scene.nodes.values())
    head = f"{', '.join(scene.sinks) or 'no sinks'}: {counted(len(scene.nodes), 'node')}, {ran} ran"
    lines = [f"{head} on {scene.device}" if scene.device else head]
    for node in scene.nodes.values():
        lines += ["", *_node(node)]
    if scene.idle:
        width = max(map(len, scene.idle))
        lines += ["", "took no part, made nothing", *(f"  {path:<{width}}  {why}" for path, why in scene.idle.items())]
    totals: dict[str, int] = dict(scene.shared)
    for node in scene.nodes.values():
        for purpose, nbytes in node.device.items():
            totals[purpose] = totals.get(purpose, 0) + nbytes
    host = sum(node.host for node in scene.nodes.values())
    memos = sum(memo.bytes for node in scene.nodes.values() for memo in node.memos)
    return "\n".join([*lines, "", f"in all: {_bytes_by_purpose(host, totals, memos)}"])


def _node(node: SceneNode) -> list[str]:
    lines = [f"{node.path}  {node.asked}".rstrip(), _row("why", node.reason.removeprefix("runs: "))]
    if node.seconds is not None:
        lines.append(_row("took", duration(node.seconds)))
    for kernel in node.kernels:
        lines += _kernel(kernel)
    lines += [_row("decided", text) for text in node.decisions]
    lines += [_row("memo", _memo(memo)) for memo in node.memos]
    if node.host or node.device:
        lines.append(_row("bytes", _bytes_by_purpose(node.host, node.device)))
    return lines


def _kernel(kernel: SceneKernel) -> list[str]:
    run = kernel.run
    times = f"{run.count} times " if run.count > 1 else ""
    built = ", compiled anew" if run.built else ""
    lines = [_row("kernel", f"{run.kernel} on {run.device}, {times}{run.work}, {duration(run.seconds)}{built}")]
    held = [str(switch) for switch in kernel.switches if switch.held]
    out = [
        f"{switch.name} ({switch.meaning})" if switch.meaning else switch.name
        for switch in kernel.switches
        if switch.matters and not switch.held
    ]
    moot = [switch.name for switch in kernel.switches if not switch.matters]
    reads = [f"{each.name} {size_of(each.bytes) if each.bytes else 'in place'}" for each in run.fields]
    writes = [" ".join(part for part in (name, size_of(nbytes)) if part) for name, nbytes in run.outputs]
    for what, texts in (
        ("holds", held),
        ("left out", out),
        ("without effect", [", ".join(moot)] if moot else []),
        ("reads", [", ".join(reads)] if reads else []),
        ("writes", [", ".join(writes)] if writes else []),
    ):
        lines += [f"  {_row(what if i == 0 else '', text)}" for i, text in enumerate(texts)]
    return lines


def _memo(memo: SceneMemo) -> str:
    parts = [duration(memo.seconds)] if memo.seconds is not None else []
    parts += [size_of(memo.bytes), "made now" if memo.made else "kept from before"]
    return f"{memo.name}: {', '.join(parts)}"


def _bytes_by_purpose(host: int, device: Mapping[str, int], memos: int = 0) -> str:
    """``host 0.3 MB, memos 20 kB, device inputs 1 MB, programs 5 kB``."""
    parts = [f"host {size_of(host)}", *([f"memos {size_of(memos)}"] if memos else [])]
    named = {purpose: device[purpose] for purpose in (*PURPOSES, *device) if device.get(purpose)}
    if named:
        parts.append("device " + ", ".join(f"{PURPOSES.get(what, what)} {size_of(n)}" for what, n in named.items()))
    return ", ".join(parts)


def _row(what: str, text: str) -> str:
    return f"    {what:<14} {text}"


def duration(seconds: float) -> str:
    """Seconds in a unit that suits them: ``0.25 ms``, ``31 ms``, ``1.2 s``."""
    return (
        f"{seconds:.3g} s"
        if seconds >= 1.0
        else f"{1e3 * seconds:.2g} ms"
        if seconds < 0.1
        else f"{1e3 * seconds:.0f} ms"
    )


def size_of(nbytes: int) -> str:
    """Bytes in a unit that suits them, by powers of 1000."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if nbytes >= scale:
            return f"{nbytes / scale:.3g} {unit}"
    return f"{nbytes} B"
