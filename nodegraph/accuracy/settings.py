"""What can be traded in a network: its knobs, the values that they may take, and copies of a network with other values.

A knob is a visible parameter that declares ``quality=``. Nothing here changes a network that belongs to somebody: other
settings go to a copy.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.accuracy.ladders import ladder
from nodegraph.errors import GraphError, ParameterError
from nodegraph.network import split
from nodegraph.overrides import declaration, to_json
from nodegraph.params import Bool, Bounded, Choice, Parameter

if TYPE_CHECKING:
    from nodegraph.network import Network

MOST = 10_000
"""As many combinations of settings as anybody would wait for."""

Settings = dict[str, Any]
"""Checked values by place: ``node.param``, ``group/node.param``, or the name of a variable."""


@dataclass(frozen=True)
class Knob:
    """A parameter that trades speed for accuracy, where it stands in a network, and what it is set to.

    place:   ``node.param`` of the plain node. Setting it sets the variable that it follows, if it follows one.
    shared:  other knobs that follow the same variable and so have the same value.
    low, high: the hard limits of a number, those of ``shared`` included; None where an end is open.
    """

    place: str
    parameter: Parameter
    value: Any
    variable: str = ""
    shared: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None

    @property
    def direction(self) -> Any:
        """Where accuracy lies: "lower", "higher", "on", "off", or the choices from the fastest to the most accurate."""
        return self.parameter.quality

    def ladder(self) -> tuple[Any, ...]:
        """Values to try, from the fastest to the most accurate; the present one is among them."""
        return ladder(self.parameter, self.value, self.low, self.high)

    def coarser(self) -> Any:
        """The next faster value, or None."""
        values = self.ladder()
        place = values.index(self.value)
        return values[place - 1] if place > 0 else None

    def finer(self) -> Any:
        """The next more accurate value, or None."""
        values = self.ladder()
        place = values.index(self.value)
        return values[place + 1] if place + 1 < len(values) else None


@dataclass(frozen=True)
class Knobs:
    """The knobs above a view, and why other parameters of quality are none, by place."""

    knobs: list[Knob] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)


def quality_parameters(network: Network, view: str) -> list[Knob]:
    """The knobs of all nodes that a view asks for, in the order in which the nodes run. Raises CommandError."""
    return find_knobs(network, view).knobs


def find_knobs(network: Network, view: str) -> Knobs:
    """The knobs above a view, and what is none: what a wire feeds or an expression decides. Raises CommandError."""
    found = Knobs()
    owners: dict[tuple[int, str], int] = {}
    for place, parameter, value in parameters_above(network, view):
        if parameter.quality is None:
            continue
        if value is WIRED:
            found.left_out[place] = "a wire decides its value"
            continue
        path, name = split(place)
        leaf = network.root.node(path)
        knob = _knob(place, parameter, value)
        link = links.link_of(leaf, name)
        if link is not None:
            holder, _, variable = link
            scoped = links.lookup(holder.parent, variable) if holder.parent is not None else None
            assert scoped is not None  # the node would be blocked, and have no visible value
            expression = scoped[0].variables[variable].expression
            if expression:
                found.left_out[place] = f"it follows {variable} = {expression}"
                continue
            key = (id(scoped[0]), variable)
            if key in owners:
                first = found.knobs[owners[key]]
                if first.direction != parameter.quality:
                    found.left_out[place] = f"it shares {variable} with {first.place}, which asks for another direction"
                else:
                    found.knobs[owners[key]] = _with_range(first, scoped, (*first.shared, place))
                continue
            owners[key] = len(found.knobs)
            knob = _with_range(knob, scoped, ())
        found.knobs.append(knob)
    return found


class _Wired:
    """The value of a parameter that only a wire brings."""

    def __repr__(self) -> str:
        return "wired"


WIRED = _Wired()


def parameters_above(network: Network, view: str) -> list[tuple[str, Parameter, Any]]:
    """(place, declaration, value or `WIRED`) of every visible parameter of the nodes that a view asks for.

    Nodes that ``needs`` cuts off are not among them. Raises CommandError for a view that does not exist.
    """
    from nodegraph.plan import plan

    tasks = plan(network.flatten(), [view], device=lambda: "none").tasks
    found: dict[str, tuple[str, Parameter, Any]] = {}
    for task in tasks:
        node = task.node
        declared = node.processor.params if node.processor is not None else {}
        for name, parameter in declared.items():
            place = f"{node.path}.{name}"
            if name in node.wired:
                found[place] = (place, parameter, WIRED)
            elif name in node.values:
                found[place] = (place, parameter, node.values[name])
    return list(found.values())


def _knob(place: str, parameter: Parameter, value: Any) -> Knob:
    low, high = (parameter.min, parameter.max) if isinstance(parameter, Bounded) else (None, None)
    return Knob(place, parameter, value, low=low, high=high)


def _with_range(knob: Knob, scoped: links.Scoped, shared: tuple[str, ...]) -> Knob:
    """A knob that is set through a variable may take what every parameter accepts that follows it."""
    low, high = links.common_range([declared for _, _, declared in links.parameters(scoped)])
    return Knob(knob.place, knob.parameter, knob.value, links.label(scoped), shared, low, high)


# -- other settings -----------------------------------------------------------------------------------------------


def copy_of(network: Network) -> Network:
    """An independent copy of a whole document; processors that are in no registry stay what they are."""
    return snapshot(network)()


def snapshot(network: Network) -> Callable[[], Network]:
    """A document as it is now; called, on any thread and as often as one likes, it makes a copy of that."""
    from nodegraph import workspace

    root = network.root
    present = {node.type: node.processor for node in root.walk() if node.processor is not None}
    find, text = root.find, workspace.dumps(root)
    return lambda: workspace.loads(text, find=lambda id: present.get(id) or find(id))


def applied(network: Network, settings: Mapping[str, Any]) -> Network:
    """A copy of a network with other values. Raises ParameterError or CommandError as `Network.set` does."""
    copy = copy_of(network)
    for place, value in settings.items():
        copy.set(place, value)
    return copy


def changes(network: Network, view: str, settings: Settings) -> Settings:
    """Those of some settings that would change a network, and that mean something above a view beside the others."""
    shown = find_knobs(applied(network, settings), view).knobs
    return {
        knob.place: settings[knob.place]
        for knob in shown
        if knob.place in settings and settings[knob.place] != network.get(knob.place)
    }


def encoded(network: Network, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings as JSON."""
    return {place: declaration(network, place).encode(value) for place, value in settings.items()}


# -- what --vary says ---------------------------------------------------------------------------------------------


def variants(text: str, network: Network) -> tuple[str, tuple[Any, ...]]:
    """The place and the checked values of ``node.param=VALUES``.

    VALUES is ``a..b`` (by factors of two, for numbers that trade speed for accuracy), ``a..b:n`` (n of them, evenly),
    ``a,b,c``, or ``all`` for choices and switches. Raises ParameterError or CommandError naming the place.
    """
    place, equals, listed = (part.strip() for part in text.partition("="))
    if not equals or not place or not listed:
        raise ParameterError(f"{text!r} is not of the form node.param=values")
    declared = declaration(network, place)
    if listed == "all" and isinstance(declared, (Choice, Bool)):
        return place, declared.choices if isinstance(declared, Choice) else (False, True)
    values = [declared.decode(to_json(word, declared), place) for word in _words(listed, declared, place)]
    if not values:
        raise ParameterError(f"{place}: {listed!r} holds no value; list some, as in {place}=1,2")
    return place, tuple(dict.fromkeys(values))


def combinations(varied: Iterable[tuple[str, tuple[Any, ...]]]) -> list[Settings]:
    """Every combination of what `variants` returned; the last place varies fastest. Raises ParameterError."""
    varied = list(varied)
    places = [place for place, _ in varied]
    twice = next((place for place in places if places.count(place) > 1), "")
    if twice:
        raise ParameterError(f"{twice}: varied twice; list all its values in one place")
    rows = list(itertools.islice(itertools.product(*(values for _, values in varied)), MOST + 1))
    if len(rows) > MOST:
        raise ParameterError(f"more than {MOST} combinations of {', '.join(places)}; vary less at a time")
    return [dict(zip(places, row, strict=True)) for row in rows]


def _words(listed: str, declared: Parameter, place: str) -> list[str]:
    """The values as they would be typed after ``--set``."""
    found = re.fullmatch(r"(.+?)\.\.(.+?)(?::(\d+))?", listed)
    if found is None or not isinstance(declared, Bounded) or declared.kind not in ("Float", "Int", "Seed"):
        # Commas inside brackets belong to one value.
        return [word.strip() for word in re.split(r",(?![^\[]*\])", listed) if word.strip()]
    try:
        first, last = float(found[1]), float(found[2])
    except ValueError:
        raise ParameterError(f"{place}: {listed!r}: the ends of a range are numbers") from None
    if found[3] is not None:
        count = int(found[3][:9])  # more digits are too many in any case, and thousands of them are no int to Python
        return [_short(number) for number in _evenly(first, last, count, place)]
    if declared.quality is None:
        raise ParameterError(f"{place}: {listed!r}: say how many values, as in {listed}:5")
    if not (0.0 < first < float("inf") and 0.0 < last < float("inf")):
        raise ParameterError(f"{place}: {listed!r}: factors of two need ends above 0; write a list instead")
    return [_short(number) for number in _doubling(first, last)]


def _evenly(first: float, last: float, count: int, place: str) -> list[float]:
    if not 1 <= count <= MOST:
        raise ParameterError(f"{place}: the number of values must be 1 to {MOST}")
    # Weighted ends rather than first + i * step: the last value is exactly the one that was asked for.
    return [(first * (count - 1 - i) + last * i) / max(count - 1, 1) for i in range(count)] if count > 1 else [first]


def _doubling(first: float, last: float) -> list[float]:
    factor = 2.0 if last >= first else 0.5
    values, value = [], first
    while (value < last) if factor > 1.0 else (value > last):
        values.append(value)
        value *= factor
    return [*values, last]


def _short(number: float) -> str:
    rounded = float(f"{number:.12g}")
    return str(int(rounded)) if rounded.is_integer() and abs(rounded) < 1e15 else repr(rounded)


def require_value(network: Network, view: str) -> None:
    """Raise the error of the first node above a view that cannot run, so that nothing is begun in vain."""
    from nodegraph.plan import plan

    for task in plan(network.flatten(), [view], device=lambda: "none").tasks:
        if isinstance(task.problem, GraphError):
            raise task.problem
