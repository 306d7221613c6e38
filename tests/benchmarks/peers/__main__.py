"""Compare with VTK, print what was found, and write docs/peers.md.

    python -m tests.benchmarks.peers [compare] [orbit] [sizes] [floor] [--side PIXELS] [--unlit] [--out FOLDER]

Without names all parts run. The page and its figures are written where all parts ran at full size, or into the
folder that is named.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from nodegraph.engine import Engine
from tests.benchmarks.peers import page, plots
from tests.benchmarks.peers.compare import Comparison, compare
from tests.benchmarks.peers.floor import Stage, stages
from tests.benchmarks.peers.large import Large, large
from tests.benchmarks.peers.limit import Counts, counts
from tests.benchmarks.peers.orbit import Orbit, orbits
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.scenes import scenes
from tests.benchmarks.peers.settings import FAINT
from tests.benchmarks.peers.sizes import Cost, costs

PARTS = ("compare", "orbit", "sizes", "floor")
SIDE = 512


def main(arguments: Sequence[str]) -> int:
    """Returns 1 where a factor that is wanted was not reached."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.peers", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--side", type=int, default=SIDE, help="of the pictures, pixels")
    parser.add_argument("--unlit", action="store_true", help="leave the scenes with light out: references take long")
    parser.add_argument("--out", type=Path, help="where the page and the figures go")
    asked = parser.parse_args(arguments)
    unknown = [part for part in asked.parts if part not in PARTS]
    if unknown:
        parser.error(f"{unknown[0]}: no such part; there are {', '.join(PARTS)}")
    parts = asked.parts or PARTS
    compared: list[Comparison] = []
    turned: list[Orbit] = []
    sized: list[Cost] = []
    streamed: list[Large] = []
    lowest: list[Stage] = []
    counted: list[Counts] = []
    with Engine("gl", disk=False) as engine:
        if "compare" in parts:
            compared = compare_all(asked.side, engine, asked.unlit)
        if "orbit" in parts:
            turned = orbits((asked.side, asked.side), engine, say)
        if "sizes" in parts:
            sized = costs(engine, say, 4 * asked.side)
            if asked.side == SIDE:
                streamed = large(say)
    if "floor" in parts:
        for stage in stages():
            say(f"{stage.name}: {stage.nanoseconds:.1f} ns of processor time a sample")
            lowest.append(stage)
        for scene in scenes(asked.side)[:2]:
            for found in counts(scene, (0.0, *FAINT) if scene.name == "sparse" else (0.0,)):
                say(
                    f"{found.scene}, step {found.step:g}, skip_opacity {found.faint:g}: {found.samples:.1f} samples, "
                    f"{found.leaps:.1f} leaps a ray"
                )
                counted.append(found)
    folder = asked.out or (page.DOCS if set(parts) == set(PARTS) and asked.side == SIDE else None)
    if folder is not None:
        if compared:
            plots.plot_fronts(compared, folder / page.FRONTS)
            plots.sheet(compared, folder / page.PICTURES)
        if sized:
            plots.plot_costs(sized, folder / page.COSTS, streamed)
        page.write(folder / page.NAME, compared, turned, sized, lowest, streamed, counted)
    missed = page.missed(compared, turned)
    for line in missed:
        print(f"missed: {line}")
    return 1 if missed else 0


def compare_all(side: int, engine: Engine, unlit: bool = False) -> list[Comparison]:
    """All scenes, those with light at half the side."""
    done = []
    for scene in scenes(side):
        if unlit and scene.lit:
            continue
        say(f"{scene.name}: {scene.visible_share():.1%} of the voxels can be seen; making the reference")
        done.append(compare(scene, engine, Ours(scene, engine).truth(say), say))
    return done


def say(text: str) -> None:
    """Print at once."""
    print(text, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
