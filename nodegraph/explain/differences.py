"""What differs between two keys of one node, in words."""

from __future__ import annotations

from collections.abc import Mapping

from nodegraph.plan import Task

Place = tuple[Task, list[Task]]
"""A task and the plan that it stands in."""


def changes(before: Place, now: Place) -> list[str]:
    """What differs between two keys of one node: parts of its own, or where further up the difference begins."""
    found: dict[tuple[str, str], None] = {}
    seen: set[tuple[bytes, bytes]] = set()
    rest = [(before, now)]
    while rest:
        (old, old_tasks), (new, new_tasks) = rest.pop()
        if (old.fingerprint, new.fingerprint) in seen:
            continue
        seen.add((old.fingerprint, new.fingerprint))
        found.update(((new.path, text), None) for text in _own_changes(old, new))
        for port in dict.fromkeys([*old.feeds, *new.feeds]):
            then, here = old.feeds.get(port, ()), new.feeds.get(port, ())
            if then is None or here is None:
                if then != here:
                    found[new.path, f"{port} {'is no longer read' if here is None else 'is read now'}"] = None
                continue
            one = [(old_tasks[place].path, output) for place, output in then]
            two = [(new_tasks[place].path, output) for place, output in here]
            if one != two:
                found[new.path, _change(f"wires of {port}", _wires(one), _wires(two))] = None
                continue
            for (old_place, _), (new_place, _) in zip(then, here, strict=True):
                above, below = old_tasks[old_place], new_tasks[new_place]
                if above.fingerprint != below.fingerprint:
                    rest.append(((above, old_tasks), (below, new_tasks)))
    texts = [text if path == now[0].path else f"{path}: {text}" for path, text in found]
    return texts or ["something it depends on changed"]


def _own_changes(old: Task, new: Task) -> list[str]:
    """What differs in a node's own part: code, parameters, files, services."""
    found = []
    if old.local.digest != new.local.digest:
        then, code = dict(old.local.code.parts), dict(new.local.code.parts)
        for what in dict.fromkeys([*then, *code]):
            if then.get(what) != code.get(what):
                found.append(_change(what, then.get(what), code.get(what)))
        found += _differences("", old.local.encoded, new.local.encoded)
        found += _differences("file ", old.local.files, new.local.files)
    was = {service.rstrip("\0").partition(" ")[0]: service.rstrip("\0").partition(" ")[2] for service in old.services}
    now = {service.rstrip("\0").partition(" ")[0]: service.rstrip("\0").partition(" ")[2] for service in new.services}
    return found + _differences("asked-for ", was, now)


def _wires(wires: list[tuple[str, str]]) -> str:
    return " ".join(f"{path}.{output}" for path, output in wires) or "nothing"


def _differences(prefix: str, old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    names = dict.fromkeys([*old, *new])
    return [_change(prefix + name, old.get(name), new.get(name)) for name in names if old.get(name) != new.get(name)]


def _change(what: str, old: str | None, new: str | None) -> str:
    if what.startswith(("source text", "shader ")):
        return f"the {what} changed"
    return f"{what} {_short(old)} -> {_short(new)}"


def _short(text: str | None) -> str:
    if text is None:
        return "not shown"
    return text if len(text) <= 60 else f"{text[:57]}..."
