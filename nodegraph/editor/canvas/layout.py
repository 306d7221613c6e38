"""Layered drawing of a network: columns from left to right, few crossings. Knows no Qt.

Source: K. Sugiyama, S. Tagawa, M. Toda 1981, "Methods for visual understanding of hierarchical system structures":
columns by longest path, order by the mean place of the neighbours, then places.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

GAP_X = 70.0
GAP_Y = 26.0
SWEEPS = 6
STRAIGHT = 8.0
"""How much more a long edge wants to be straight than a node wants to be level with its neighbours."""
BEND = (0.0, 12.0)
"""Size of the room that an edge gets in a column that it passes."""

Size = tuple[float, float]


def layered(sizes: Mapping[str, Size], edges: Iterable[tuple[str, str]]) -> dict[str, tuple[float, float]]:
    """Top-left places of nodes, given as (width, height), so that every edge (from, to) runs to the right.

    Parts that hang together stand below each other. Edges of a cycle that a broken file may hold are ignored where
    they would run back.
    """
    above: dict[str, list[str]] = {id: [] for id in sizes}
    below: dict[str, list[str]] = {id: [] for id in sizes}
    for source, target in dict.fromkeys(edges):
        if source in above and target in above and source != target:
            above[target].append(source)
            below[source].append(target)
    places: dict[str, tuple[float, float]] = {}
    top = 0.0
    singles: list[str] = []
    for part in _parts(list(sizes), above, below):
        if len(part) == 1:
            singles += part
            continue
        drawn, height = _draw(part, sizes, above, below)
        places.update({id: (x, y + top) for id, (x, y) in drawn.items()})
        top += height + 2 * GAP_Y
    x = 0.0
    row = 0.0
    for id in singles:
        if x > 0 and x + sizes[id][0] > 1400:
            x, top, row = 0.0, top + row + GAP_Y, 0.0
        places[id] = (x, top)
        x += sizes[id][0] + GAP_X
        row = max(row, sizes[id][1])
    return {id: (round(px), round(py)) for id, (px, py) in places.items()}


def _parts(ids: Sequence[str], above: Mapping[str, list[str]], below: Mapping[str, list[str]]) -> list[list[str]]:
    """Ids by connected part, in order of first appearance."""
    part: dict[str, int] = {}
    count = 0
    for start in ids:
        if start in part:
            continue
        stack = [start]
        part[start] = count
        while stack:
            id = stack.pop()
            for other in (*above[id], *below[id]):
                if other not in part:
                    part[other] = count
                    stack.append(other)
        count += 1
    found: list[list[str]] = [[] for _ in range(count)]
    for id in ids:
        found[part[id]].append(id)
    return found


def _columns(part: Sequence[str], above: Mapping[str, list[str]], below: Mapping[str, list[str]]) -> dict[str, int]:
    """Column of each node: the longest way from a source; sources then stand right before their first reader."""
    waiting = {id: len(above[id]) for id in part}
    column = dict.fromkeys(part, 0)
    ready = [id for id in part if not waiting[id]]
    order: list[str] = []
    left = dict.fromkeys(part)
    while left:
        # In a cycle nothing is ever ready: break it at its first node.
        id = ready.pop(0) if ready else next(iter(left))
        if id not in left:
            continue
        del left[id]
        order.append(id)
        for other in below[id]:
            if other in left:
                column[other] = max(column[other], column[id] + 1)
                waiting[other] -= 1
                if waiting[other] == 0:
                    ready.append(other)
    for id in reversed(order):
        if not above[id] and below[id]:
            column[id] = max(0, min(column[other] for other in below[id]) - 1)
    return column


def _with_bends(
    part: Sequence[str],
    sizes: Mapping[str, Size],
    above: Mapping[str, list[str]],
    below: Mapping[str, list[str]],
    column: dict[str, int],
) -> tuple[dict[str, Size], dict[str, list[str]], dict[str, list[str]]]:
    """The part with a small node in every column that an edge passes, so that it finds room between the others."""
    sized = {id: sizes[id] for id in part}
    into: dict[str, list[str]] = {id: [] for id in part}
    out: dict[str, list[str]] = {id: [] for id in part}
    for id in part:
        for source in above[id]:
            last = source
            for place in range(column[source] + 1, column[id]):
                bend = f"{source}>{id}>{place}"  # no id has such a sign
                sized[bend], column[bend] = BEND, place
                into[bend], out[bend] = [last], []
                out[last].append(bend)
                last = bend
            out[last].append(id)
            into[id].append(last)
    return sized, into, out


def _draw(
    part: Sequence[str], sizes: Mapping[str, Size], above: Mapping[str, list[str]], below: Mapping[str, list[str]]
) -> tuple[dict[str, tuple[float, float]], float]:
    """Places of one connected part, and its height."""
    column = _columns(part, above, below)
    sizes, above, below = _with_bends(part, sizes, above, below, column)
    columns: list[list[str]] = [[] for _ in range(max(column.values()) + 1)]
    for id in column:
        columns[column[id]].append(id)
    for sweep in range(SWEEPS):
        rightwards = sweep % 2 == 0
        neighbours = above if rightwards else below
        rank = {id: (i + 0.5) / len(ids) for ids in columns for i, id in enumerate(ids)}
        for ids in columns if rightwards else reversed(columns):
            middle = {
                id: sum(rank[other] for other in neighbours[id]) / len(neighbours[id]) if neighbours[id] else rank[id]
                for id in ids
            }
            ids.sort(key=middle.__getitem__)
            rank.update({id: (i + 0.5) / len(ids) for i, id in enumerate(ids)})
    y = _heights(columns, sizes, above, below)
    places: dict[str, tuple[float, float]] = {}
    x = 0.0
    for ids in columns:
        for id in ids:
            places[id] = (x, y[id])
        x += max((sizes[id][0] for id in ids), default=0.0) + GAP_X
    shown = set(part)
    highest = min(y[id] for id in part)
    height = max(y[id] + sizes[id][1] for id in part) - highest
    return {id: (px, py - highest) for id, (px, py) in places.items() if id in shown}, height


def _heights(
    columns: Sequence[Sequence[str]],
    sizes: Mapping[str, Size],
    above: Mapping[str, list[str]],
    below: Mapping[str, list[str]],
) -> dict[str, float]:
    """Top of each node: near the middle of its neighbours, in the order of its column and apart from the next."""
    y: dict[str, float] = {}
    for ids in columns:
        top = 0.0
        for id in ids:
            y[id] = top
            top += sizes[id][1] + GAP_Y

    def wish(id: str, neighbours: Sequence[str]) -> float:
        if not neighbours:
            return y[id]
        weights = [STRAIGHT if sizes[other] == BEND else 1.0 for other in neighbours]
        middles = (weight * (y[other] + sizes[other][1] / 2) for weight, other in zip(weights, neighbours, strict=True))
        return sum(middles) / sum(weights) - sizes[id][1] / 2

    for sweep in range(SWEEPS):
        neighbours = above if sweep % 2 == 0 else below
        for ids in columns if sweep % 2 == 0 else reversed(columns):
            wanted = [wish(id, neighbours[id]) for id in ids]
            weights = [STRAIGHT if sizes[id] == BEND else 1.0 for id in ids]
            y.update(zip(ids, _apart(wanted, weights, [sizes[id][1] + GAP_Y for id in ids]), strict=True))
    return y


def _apart(wanted: Sequence[float], weights: Sequence[float], heights: Sequence[float]) -> list[float]:
    """Tops nearest to the wanted ones (weighted least squares) that keep order and do not overlap.

    Neighbours that would overlap are pooled into blocks, each with its weighted sum of wanted tops, weight, height and
    number of members.
    """
    blocks: list[list[float]] = []
    for want, weight, height in zip(wanted, weights, heights, strict=True):
        blocks.append([weight * want, weight, height, 1])
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] + blocks[-2][2] > blocks[-1][0] / blocks[-1][1]:
            last = blocks.pop()
            first = blocks[-1]
            first[0] += last[0] - last[1] * first[2]
            for i in (1, 2, 3):
                first[i] += last[i]
    tops: list[float] = []
    for total, weight, _, members in blocks:
        top = total / weight
        for _ in range(int(members)):
            tops.append(top)
            top += heights[len(tops) - 1]
    return tops
