"""Values that change with time: key frames of parameters, as the document holds them.

The keys of a parameter are part of the node's ``ui``, so they follow the node when it is renamed, copied, grouped or
removed, are undone like everything else, and change nothing of what `nodegraph run` computes:

    "ui": {"animation": {"frames": [0, 120], "rate": 25},
           "nodes": {"view": {"animation": {"camera": [[0, {...}, "smooth"], [120, {...}, "smooth"]]}}}}

A key is [frame, value as JSON, easing of the way to the next key]. The variable ``frame``, where the document has it,
counts along.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from nodegraph import links
from nodegraph.camera_path import between, orbit
from nodegraph.commands import Command, Set, SetUI
from nodegraph.data import Camera, Light, Plane, TransferFunction, TransferFunction2D
from nodegraph.errors import ParameterError, near_miss
from nodegraph.network import Network, split
from nodegraph.variable_commands import SetVariable

UI = "animation"
"""The key of ``ui`` that holds all this, of the workspace and of nodes."""

EASINGS: dict[str, Callable[[float], float]] = {
    "smooth": lambda t: t * t * (3.0 - 2.0 * t),
    "linear": lambda t: t,
    "accelerate": lambda t: t * t,
    "brake": lambda t: t * (2.0 - t),
    "hold": lambda t: 0.0,
}
"""How far the way to the next key is after a part of the time, both 0..1."""


@dataclass(frozen=True, slots=True)
class Span:
    """The pictures of an animation: ``first`` to ``last``, both shown, ``rate`` a second."""

    first: int = 0
    last: int = 120
    rate: int = 25

    @property
    def frames(self) -> range:
        return range(self.first, self.last + 1)


@dataclass(frozen=True, slots=True)
class Key:
    """A value at a frame, and how it goes on from there."""

    frame: int
    value: Any
    easing: str = "smooth"


@dataclass(frozen=True, slots=True)
class Track:
    """The keys of one parameter, ``node.parameter``, in order of their frames; there is at least one."""

    target: str
    keys: tuple[Key, ...]

    def at(self, frame: float) -> Any:
        """The value at a frame: before the first key that of the first, after the last that of the last."""
        place = bisect_right([key.frame for key in self.keys], frame) - 1
        if place < 0 or place == len(self.keys) - 1:
            return self.keys[max(place, 0)].value
        a, b = self.keys[place], self.keys[place + 1]
        return mixed(a.value, b.value, EASINGS[a.easing]((frame - a.frame) / (b.frame - a.frame)))

    def with_key(self, key: Key) -> Track:
        """With a key, in place of the one at its frame if there is one."""
        others = [other for other in self.keys if other.frame != key.frame]
        return Track(self.target, tuple(sorted([*others, key], key=lambda k: k.frame)))


# -- values between keys ---------------------------------------------------------------------------------------------


def mixed(a: Any, b: Any, t: float) -> Any:
    """The value a part ``t`` of the way from one value of a parameter to another.

    Numbers, and all that is made of numbers, mix; whole numbers are rounded. Cameras go around their focus, normals
    turn. What cannot be mixed (texts, switches, transfer functions of different counts of keys) stays ``a`` until
    ``t`` is 1.
    """
    if t <= 0.0 or a is None or b is None:
        return a
    if t >= 1.0:
        return b
    if isinstance(a, bool) or isinstance(b, bool):
        return a
    if isinstance(a, int) and isinstance(b, int):
        return round(a + (b - a) * t)
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        # Weighted ends: huge numbers of two signs stay finite.
        return (1.0 - t) * a + t * b if math.isfinite(a) and math.isfinite(b) else a
    if isinstance(a, tuple) and isinstance(b, tuple):
        return tuple(mixed(x, y, t) for x, y in zip(a, b, strict=True)) if len(a) == len(b) else a
    if isinstance(a, Camera) and isinstance(b, Camera):
        return between(a, b, t)
    if isinstance(a, Plane) and isinstance(b, Plane):
        return _plane(a, b, t)
    if isinstance(a, (Light, TransferFunction, TransferFunction2D)) and type(a) is type(b):
        return _by_json(a, b, t)
    return a


def _plane(a: Plane, b: Plane, t: float) -> Plane:
    """The origin on a line, the normal turning the shorter way; opposite normals have none, so they jump."""
    import numpy as np

    x, y = a.unit_normal, b.unit_normal
    angle = math.atan2(float(np.linalg.norm(np.cross(x, y))), float(x @ y))
    if angle < 1e-9 or math.pi - angle < 1e-6:
        normal: Any = a.normal
    else:
        normal = tuple(((math.sin((1 - t) * angle) * x + math.sin(t * angle) * y) / math.sin(angle)).tolist())
    return Plane(mixed(a.origin, b.origin, t), normal)


def _by_json(a: Any, b: Any, t: float) -> Any:
    """Mix the numbers of two objects whose JSON is alike in all else; otherwise ``a``."""
    found = _mixed_json(a.to_json(), b.to_json(), t)
    return a if found is None else type(a).from_json(found)


def _mixed_json(a: Any, b: Any, t: float) -> Any:
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        parts = {name: _mixed_json(a[name], b[name], t) for name in a}
        return None if None in parts.values() else parts
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        listed = [_mixed_json(x, y, t) for x, y in zip(a, b, strict=True)]
        return None if None in listed else listed
    if isinstance(a, (int, float)) and isinstance(b, (int, float)) and not isinstance(a, bool):
        return mixed(float(a), float(b), t)
    return a if a == b else None


# -- the document -----------------------------------------------------------------------------------------------------


def span_of(network: Network) -> Span:
    """The frames that the document names; 0 to 120 at 25 a second where it names none. Raises ParameterError."""
    told = network.ui.get(UI, {})
    usual = Span()
    try:
        first, last = told.get("frames", (usual.first, usual.last))
        rate = told.get("rate", usual.rate)
        span = Span(int(first), int(last), int(rate))
    except (AttributeError, TypeError, ValueError):
        raise ParameterError('ui.animation: expected {"frames": [first, last], "rate": pictures a second}') from None
    if span.last < span.first or not 1 <= span.rate <= 1000:
        raise ParameterError("ui.animation: the last frame comes before the first, or the rate is not 1 to 1000")
    return span


def tracks_of(network: Network) -> list[Track]:
    """All tracks, in the order of the nodes. Raises ParameterError naming the place of what cannot be used."""
    found = []
    for node in network.walk():
        told = node.ui.get(UI)
        if told is None:
            continue
        if not isinstance(told, dict):
            raise ParameterError(f'{node.path}.ui.animation: expected {{"parameter": [[frame, value, easing], ...]}}')
        found += [_read(network, f"{node.path}.{param}", keys) for param, keys in told.items()]
    return found


def _read(network: Network, target: str, told: Any) -> Track:
    path, param = split(target)
    declared = links.plain_parameter(network.node(path), param)[2]
    keys = []
    if not isinstance(told, list) or not told:
        raise ParameterError(f"{target}: its animation must be a list of at least one key [frame, value, easing]")
    for entry in told:
        if not isinstance(entry, list) or len(entry) != 3 or not isinstance(entry[0], int):
            raise ParameterError(f"{target}: expected a key [frame, value, easing], got {entry!r}")
        frame, value, easing = entry
        if easing not in EASINGS:
            raise ParameterError(f"{target}: no such easing {easing!r}{near_miss(str(easing), EASINGS)}")
        keys.append(Key(frame, declared.decode(value, f"{target} at frame {frame}"), easing))
    frames = [key.frame for key in keys]
    if frames != sorted(set(frames)):
        raise ParameterError(f"{target}: the frames of its keys must rise")
    return Track(target, tuple(keys))


def write_span(span: Span) -> Command:
    """The command that notes the frames in the document."""
    return SetUI("", UI, {"frames": [span.first, span.last], "rate": span.rate})


def write_track(network: Network, track: Track) -> Command:
    """The command that notes a track in the document; one without keys is removed. Raises ParameterError."""
    path, param = split(track.target)
    node = network.node(path)
    declared = links.plain_parameter(node, param)[2]
    there = {name: keys for name, keys in node.ui.get(UI, {}).items() if name != param}
    if track.keys:
        there[param] = [[key.frame, declared.encode(key.value), key.easing] for key in track.keys]
    return SetUI(path, UI, there or None)


def track_of(network: Network, target: str) -> Track:
    """The track that decides a parameter: its own or that of another one of the same variable; empty without one."""
    place = shared_place(network, target)
    for track in tracks_of(network):
        if shared_place(network, track.target) == place:
            return track
    return Track(target, ())


def key_at(network: Network, target: str, frame: int) -> Command:
    """The command that sets a key at a frame for the value that a parameter has now. Raises ParameterError."""
    return write_track(network, track_of(network, target).with_key(Key(frame, links.value_of(network, target))))


def without_key(network: Network, target: str, frame: int) -> Command:
    """The command that removes the key of a parameter at a frame; a track without any goes, too."""
    track = track_of(network, target)
    return write_track(network, Track(track.target, tuple(key for key in track.keys if key.frame != frame)))


def shared_place(network: Network, target: str) -> str:
    """One name for all parameters that share a value: of the variable that a parameter follows, else its own."""
    path, param = split(target)
    node, name, _ = links.plain_parameter(network.node(path), param)
    link = links.link_of(node, name)
    if link is None or link[0].parent is None:
        return f"{node.path}.{name}"
    scoped = links.lookup(link[0].parent, link[2])
    return links.label(scoped) if scoped is not None else f"{node.path}.{name}"


# -- time -------------------------------------------------------------------------------------------------------------


def moves(network: Network, frame: int, tracks: Iterable[Track]) -> list[Command]:
    """The commands that bring a document to a frame; none for what has its value already."""
    found: list[Command] = []
    variable = network.variables.get(links.FRAME)
    if variable is not None and not variable.expression and variable.value != frame:
        found.append(SetVariable(links.FRAME, frame))
    for track in tracks:
        path, param = split(track.target)
        declared = links.plain_parameter(network.node(path), param)[2]
        value = track.at(frame)
        if not links.same(declared, value, links.value_of(network, track.target)):
            found.append(Set(track.target, value))
    return found


def turntable(target: str, camera: Camera, first: int, last: int, degrees: float = 360.0) -> Track:
    """Keys that turn a camera evenly about its up, ``degrees`` in all.

    The turn is complete one frame after ``last``, so that a film of a full turn runs on without a double picture.
    """
    parts = max(1, math.ceil(abs(degrees) / 90.0))  # keys close enough for the shorter way to be the right one
    count = last + 1 - first
    frames = sorted({first + round(count * i / parts) for i in range(parts + 1)})
    turned = [Key(frame, orbit(camera, degrees * (frame - first) / count), "linear") for frame in frames]
    return Track(target, tuple(turned))
