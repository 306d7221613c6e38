"""What was found, as docs/peers.md tells it."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.measure import ms
from tests.benchmarks.peers.compare import Comparison, Match
from tests.benchmarks.peers.floor import Stage
from tests.benchmarks.peers.large import Large
from tests.benchmarks.peers.limit import SAMPLE, VALUE, Counts
from tests.benchmarks.peers.orbit import WANTED, Orbit
from tests.benchmarks.peers.plots import GAIN, NAMES
from tests.benchmarks.peers.sizes import Cost
from tests.benchmarks.peers.vtk_peer import KINDS

DOCS = Path(__file__).resolve().parents[3] / "docs"
NAME = "peers.md"
FRONTS, COSTS, PICTURES = (Path("images") / f"peers_{what}.png" for what in ("fronts", "sizes", "pictures"))
BEGIN, END = "<!-- measured: written by make bench-peers -->", "<!-- end of what make bench-peers writes -->"


def missed(compared: Sequence[Comparison], turned: Sequence[Orbit]) -> list[str]:
    """What is not as it is wanted, a sentence each."""
    lines = [
        f"{match.scene.name}, {NAMES[match.kind]}, step {match.theirs.settings['step']:g}: "
        f"{match.factor:.2f} times as fast, {match.wanted:g} is wanted"
        for found in compared
        for match in found.matches
        if match.factor < match.wanted and not match.strict
    ]
    lines += [
        f"{found.scene.name}: the front lies above that of {NAMES[kind]}"
        for found in compared
        for kind in KINDS
        if not found.advantage(kind) > 1.0
    ]
    return lines + [
        f"orbit, {orbit.scene}: {orbit.frames_per_second:.1f} frames a second, {WANTED:g} are wanted"
        for orbit in turned
        if orbit.quality == "interactive" and orbit.frames_per_second < WANTED
    ]


def write(
    path: Path,
    compared: Sequence[Comparison],
    turned: Sequence[Orbit],
    sized: Sequence[Cost],
    lowest: Sequence[Stage],
    streamed: Sequence[Large] = (),
    counted: Sequence[Counts] = (),
) -> None:
    """Put the figures between the two marks of the page; the text around them stays."""
    from tests.benchmarks.measure import machine
    from tests.benchmarks.peers.vtk_peer import version

    peer = f"; VTK {version()}" if compared or sized else ""
    parts = [f"Measured {datetime.date.today().isoformat()} on {machine()}{peer}."]
    if compared:
        parts += [_matches(compared), _fronts(compared), _pictures()]
    if turned:
        parts.append(_orbits(turned))
    if sized:
        parts.append(_costs(sized))
    if streamed:
        parts.append(_large(streamed))
    if lowest:
        parts.append(_floor(lowest))
    if counted:
        parts.append(_limit(counted, lowest, compared))
    page = path if path.exists() else DOCS / NAME
    text = page.read_text("utf-8")
    measured = f"{BEGIN}\n\n" + "\n\n".join(parts) + f"\n\n{END}"
    text, count = re.subn(re.escape(BEGIN) + ".*" + re.escape(END), lambda _: measured, text, flags=re.DOTALL)
    if count != 1:
        raise SystemExit(f"{page}: the two marks of the measured part are missing")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
    print(f"wrote {path}")


def _matches(compared: Sequence[Comparison]) -> str:
    lines = [
        "## Time at no larger error",
        "",
        "| scene | pixels | VTK, step in voxels | VTK | its RMSE | bar | nodegraph | our RMSE | our setting | faster | "
        "wanted | with every ray |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [_row(match) for found in compared for match in found.matches]
    return "\n".join(lines)


def _row(match: Match) -> str:
    theirs, ours = match.theirs, match.ours
    step = theirs.settings["step"]
    cells = [match.scene.name, f"{match.scene.size[0]}^2", f"{match.kind}, {step:g}"]
    cells += [ms(theirs.seconds), f"{theirs.rmse:.2e}"]
    cells += [f"{match.bar:.2e}"]
    cells += [ms(ours.seconds), f"{ours.rmse:.2e}", ours.label] if ours else ["", "", "none is as accurate"]
    wanted = "" if match.strict else f"{match.wanted:g} x"
    return f"| {' | '.join([*cells, f'{match.factor:.1f} x', wanted, f'{match.whole_factor:.1f} x'])} |"


def _fronts(compared: Sequence[Comparison]) -> str:
    lines = [
        "## Error over time",
        "",
        f"![error over time]({FRONTS.as_posix()})",
        "",
        "The least factor by which we are faster, over all steps of VTK from 4 to 1/4 voxel:",
        "",
        "| scene | " + " | ".join(NAMES[kind] for kind in KINDS) + " |",
        "| --- |" + " --- |" * len(KINDS),
    ]
    for found in compared:
        lines.append(f"| {found.scene.name} | " + " | ".join(f"{found.advantage(kind):.1f} x" for kind in KINDS) + " |")
    return "\n".join(lines)


def _pictures() -> str:
    return (
        f"![pictures]({PICTURES.as_posix()})\n\nFrom left to right: the reference, nodegraph at the error of the GPU "
        "mapper, VTK's GPU and fixed-point mapper at a step of 1 voxel, and how these three differ from the "
        f"reference, times {GAIN:g}."
    )


def _orbits(turned: Sequence[Orbit]) -> str:
    lines = [
        "## Going round: 60 frames of the chest",
        "",
        "| scene | quality | work | frames a second | wanted | median | slowest | RMSE | greatest difference |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for orbit in turned:
        wanted = f"{WANTED:g}" if orbit.quality == "interactive" else ""
        lines.append(
            f"| {orbit.scene} | {orbit.quality} | 1 / {orbit.coarseness} | {orbit.frames_per_second:.1f} | {wanted} | "
            f"{ms(orbit.median)} | "
            f"{ms(orbit.slowest)} | {orbit.rmse:.2e} | {orbit.maximum:.2e} |"
        )
    return "\n".join(lines)


def _costs(sized: Sequence[Cost]) -> str:
    lines = [
        "## Cost against size",
        "",
        f"![cost against size]({COSTS.as_posix()})",
        "",
        "The same step of 1 voxel for all, one sample a step, so the errors differ.",
        "",
        "| scene | voxels | pixels | " + " | ".join(NAMES.values()) + " |",
        "| --- | --- | --- |" + " --- |" * len(NAMES),
    ]
    for cost in sized:
        times = " | ".join(ms(cost.seconds[who]) for who in NAMES)
        lines.append(f"| {cost.scene} | {cost.side}^3 | {cost.picture}^2 | {times} |")
    return "\n".join(lines)


def _large(streamed: Sequence[Large]) -> str:
    lines = [
        "## Volumes larger than the memory budget",
        "",
        "The sparse scene, 512 x 512 pixels, as 16-bit voxels in a file. The first frame looks through all of "
        "it. Held: the most memory meanwhile, without pages of a mapped file.",
        "",
        "| voxels | file | budget | rendered | first frame | a frame, wall | processor | held |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in streamed:
        how = "in blocks" if one.blocks else "in one piece"
        lines.append(
            f"| {one.side}^3 | {one.case} | {one.budget_mb} MB | {how} | {ms(one.first)} | {ms(one.seconds)} | "
            f"{ms(one.processor)} | {one.held / 1e6:.0f} MB |"
        )
    return "\n".join(lines)


def _floor(lowest: Sequence[Stage]) -> str:
    lines = [
        "## The floor",
        "",
        "What a sample costs at the least on this OpenGL, in a shader that does nothing else:",
        "",
        "| what is done for each sample | processor time |",
        "| --- | --- |",
    ]
    return "\n".join(lines + [f"| {stage.name} | {stage.nanoseconds:.1f} ns |" for stage in lowest])


def _limit(counted: Sequence[Counts], lowest: Sequence[Stage], compared: Sequence[Comparison]) -> str:
    lines = [
        "## The limit",
        "",
        "What a ray takes on average, and how long a frame would take if reading voxels and bricks were all that is "
        "done, at these costs and on all cores; and if values were classified and blended, too. Samples and leaps are "
        "those of the busiest of eight neighbouring rays. Beside it what the wanted factors come to at the same step.",
        "",
        "| scene | step | skip_opacity | segments in the volume | samples that can be seen | samples in step | "
        "leaps in step | reading alone | with table and blending | wanted against GPU mapper | "
        "against fixed-point mapper |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in counted:
        matches = [
            match
            for found in compared
            for match in found.matches
            if (match.scene.name, match.theirs.settings["step"]) == (one.scene, one.step)
        ]
        pixels = matches[0].scene.size[0] * matches[0].scene.size[1] if matches else 512 * 512
        cells = [one.scene, f"{one.step:g}", f"{one.faint:g}"]
        cells += [f"{n:.1f}" for n in (one.segments, one.visible, one.samples, one.leaps)]
        cells += [ms(one.seconds(pixels, lowest, each)) for each in (VALUE, SAMPLE)]
        for kind in KINDS:
            cells.append(next((ms(m.theirs.seconds / m.wanted) for m in matches if m.kind == kind), ""))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)
