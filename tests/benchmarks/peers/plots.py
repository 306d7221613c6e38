"""The figures of docs/peers.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.peers.compare import Comparison
from tests.benchmarks.peers.large import Large
from tests.benchmarks.peers.points import Picture, front
from tests.benchmarks.peers.sizes import Cost

COLORS = {"ours": "#d1495b", "gpu": "#00798c", "fixed-point": "#edae49"}
NAMES = {"ours": "nodegraph, OpenGL", "gpu": "VTK, GPU mapper", "fixed-point": "VTK, fixed-point mapper"}
GAIN = 10.0
TILE = 128


def plot_fronts(comparisons: Sequence[Comparison], path: Path) -> None:
    """Error over time for each scene, both logarithmic; lower and further left is better."""
    figure, panels = _panels(len(comparisons))
    for panel, found in zip(panels, comparisons, strict=True):
        every = found.ours["gpu"]
        panel.scatter([p.seconds * 1e3 for p in every], [p.rmse for p in every], s=6, color=COLORS["ours"], alpha=0.25)
        best = front(every)
        panel.plot(
            [p.seconds * 1e3 for p in best],
            [p.rmse for p in best],
            "o-",
            ms=4,
            color=COLORS["ours"],
            label=NAMES["ours"],
        )
        for kind, points in found.theirs.items():
            times, style = [p.seconds * 1e3 for p in points], {"ms": 4, "color": COLORS[kind]}
            panel.plot(times, [p.rmse for p in points], "s--", label=NAMES[kind], **style)
            if found.unlit and kind == "fixed-point":
                panel.plot(times, [found.unlit[p.settings["step"]] for p in points], "s:", alpha=0.5, **style)
        panel.set(xscale="log", yscale="log", title=found.scene.name, xlabel="ms a frame", ylabel="RMSE, linear RGB")
        _plain(panel.xaxis)
        panel.grid(alpha=0.3, which="both")
    panels[0].legend(fontsize=8)
    _save(figure, path)


def plot_costs(costs: Sequence[Cost], path: Path, streamed: Sequence[Large] = ()) -> None:
    """Time over the side of the volume and of the picture; volumes in blocks beside the first scene, theirs."""
    names = list(dict.fromkeys(cost.scene for cost in costs))
    figure, panels = _panels(2 * len(names))
    usual = max({cost.picture for cost in costs}, key=lambda picture: sum(cost.picture == picture for cost in costs))
    side = max({cost.side for cost in costs}, key=lambda side: sum(cost.side == side for cost in costs))
    for i, name in enumerate(names):
        own = [cost for cost in costs if cost.scene == name]
        by_volume = sorted((cost for cost in own if cost.picture == usual), key=lambda cost: cost.side)
        by_picture = sorted((cost for cost in own if cost.side == side), key=lambda cost: cost.picture)
        for who in COLORS:
            style = {"color": COLORS[who], "label": NAMES[who]}
            panels[2 * i].plot([c.side for c in by_volume], [c.seconds[who] * 1e3 for c in by_volume], "o-", **style)
            panels[2 * i + 1].plot(
                [c.picture for c in by_picture], [c.seconds[who] * 1e3 for c in by_picture], "o-", **style
            )
        panels[2 * i].set(title=f"{name}, {usual} x {usual} pixels", xlabel="voxels a side")
        panels[2 * i + 1].set(title=f"{name}, {side}^3 voxels", xlabel="pixels a side")
    for marker, case in zip("sD^v", dict.fromkeys(one.case for one in streamed if one.blocks), strict=False):
        own_kind = [one for one in streamed if one.case == case and one.blocks]
        sides, times = [one.side for one in own_kind], [one.seconds * 1e3 for one in own_kind]
        panels[0].plot(sides, times, marker + ":", color="black", label=f"ours in blocks, {case}")
    for panel in panels:
        panel.set_xscale("log", base=2)
        panel.set(yscale="log", ylabel="ms a frame")
        _plain(panel.xaxis)
        _plain(panel.yaxis)
        panel.grid(alpha=0.3, which="both")
    panels[0].legend(fontsize=8)
    _save(figure, path)


def sheet(comparisons: Sequence[Comparison], path: Path) -> None:
    """Pictures of all, and how they differ from the reference, amplified."""
    import matplotlib.image

    rows = []
    for found in comparisons:
        names = list(dict.fromkeys(name for name in ("reference", "ours", *COLORS) if name in found.pictures))
        shown = [found.pictures[name] for name in names]
        apart = [np.abs(picture - shown[0]) * GAIN for picture in shown[1:]]
        rows.append(np.hstack([_small(picture) for picture in (*shown, *apart)]))
    path.parent.mkdir(parents=True, exist_ok=True)
    matplotlib.image.imsave(path, np.clip(np.vstack(rows), 0.0, 1.0) ** (1 / 2.2))


def _small(picture: Picture) -> Picture:
    """Every pixel that a smaller picture has room for: differences are not to be averaged away."""
    factor = max(1, picture.shape[0] // TILE)
    return picture[::factor, ::factor]


def _panels(count: int) -> tuple[Any, list[Any]]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = (count + 1) // 2
    figure, grid = pyplot.subplots(rows, 2, figsize=(10, 3.6 * rows), squeeze=False, layout="constrained")
    panels = list(grid.flat)
    for left in panels[count:]:
        left.set_axis_off()
    return figure, panels[:count]


def _plain(axis: Any) -> None:
    """Plain numbers at the main ticks, none between them."""
    from matplotlib.ticker import FormatStrFormatter, NullFormatter

    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def _save(figure: Any, path: Path) -> None:
    from matplotlib import pyplot

    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    pyplot.close(figure)
