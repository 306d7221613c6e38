"""Draw docs/images/convergence-*.png: error over step for each integrator, measured in double precision.

python -m tests.accuracy.plot_convergence
"""

from __future__ import annotations

from pathlib import Path

from nodegraph.compute import Devices
from tests.support import convergence, convergence_2d
from tests.support.convergence import FIELDS, order

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"
MARKS = ("o", "s", "D", "^", "v", "P", "X", "*")
TITLES = {"smooth": "smooth transfer function", "discontinuous": "transfer function with a jump"}
KINDS = {
    "convergence": (convergence, "by value"),
    "convergence-2d": (convergence_2d, "by value and gradient magnitude"),
}


def draw(device, kind, what, path):
    """One picture: a line for each integrator, with the slope that was measured and the one that theory says."""
    from matplotlib.figure import Figure

    cases, by = KINDS[kind]
    figure = Figure(figsize=(6.4, 4.6), dpi=110, layout="constrained")
    axes = figure.subplots()
    for number, (case, mark) in enumerate(zip(cases.CASES, MARKS, strict=False)):
        steps, found = cases.errors(case, what, device)
        label = f"{case.name}: {order(steps, found):.2f} ({case.order[what]})"
        dashes = "--" if case.params["integrator"] == "cellwise" else "-"
        axes.loglog(steps, found, dashes, marker=mark, markersize=5, linewidth=1.4, color=f"C{number}", label=label)
        print(f"{what:14} {label}")
    axes.set_xscale("log", base=2)
    axes.xaxis.set_major_formatter(lambda step, _: f"{step:g}" if step >= 1 else f"1/{1 / step:g}")
    cells = " (cellwise: size of a cell)" if cases is convergence else ""
    axes.set_xlabel(f"step, mm{cells}")
    axes.set_ylabel("root mean square error of colour and opacity")
    axes.set_title(f"{TITLES[what]},\n{by}", fontsize=11)
    axes.grid(True, which="major", linewidth=0.4, alpha=0.6)
    figure.legend(
        title="measured order (theory)", fontsize=8, title_fontsize=8, loc="outside right upper", frameon=False
    )
    figure.savefig(path, metadata={"Software": None})


def main():
    devices = Devices()
    try:
        device = devices.choose("cl64").device
        for kind in KINDS:
            for what in FIELDS:
                draw(device, kind, what, FOLDER / f"{kind}-{what}.png")
    finally:
        devices.close()


if __name__ == "__main__":
    main()
