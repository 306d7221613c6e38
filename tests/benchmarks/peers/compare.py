"""Time at equal error: how long do we need for a picture that is no farther from the converged one than VTK's?"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from nodegraph.data import Camera
from nodegraph.engine import Engine
from tests.benchmarks.measure import interleaved
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.points import Picture, Point, advantage, cheapest, errors, timed
from tests.benchmarks.peers.scenes import Scene
from tests.benchmarks.peers.settings import ladders
from tests.benchmarks.peers.vtk_peer import BITS, KINDS, Vtk

STEPS = tuple(2.0 ** (k / 2) for k in range(4, -5, -1))
"""Of VTK, voxels: 4 to 1/4."""
TOLD = (2.0, 1.0, 0.5)
"""Of these, the steps that the tables tell of."""
CANDIDATES = 3
WANTED = {
    ("sparse", "gpu"): 4.0,
    ("sparse", "fixed-point"): 3.0,
    ("dense", "gpu"): 2.0,
    ("dense", "fixed-point"): 1.5,
}


@dataclass(frozen=True)
class Match:
    """One picture of VTK's, and the cheapest of ours that is no worse.

    bar:    the error that ours had to keep.
    strict: the bar is not the error of VTK's picture, but see `Comparison.unlit`.
    whole:  the cheapest of those of ours in which the ray of every pixel is cast.
    """

    scene: Scene
    kind: str
    theirs: Point
    bar: float
    ours: Point | None
    whole: Point | None = None
    strict: bool = False

    @property
    def factor(self) -> float:
        """How many times faster we are; 0 where no setting of ours is accurate enough."""
        return self.theirs.seconds / self.ours.seconds if self.ours else 0.0

    @property
    def whole_factor(self) -> float:
        """The same where every pixel's ray is cast."""
        return self.theirs.seconds / self.whole.seconds if self.whole else 0.0

    @property
    def wanted(self) -> float:
        return WANTED[self.scene.name.split(",")[0], self.kind]


@dataclass
class Comparison:
    """All that was measured of one scene.

    unlit: by step, errors of the fixed-point mapper in the same scene without light, if it has light. It lights by
           another model (normals of voxels, rounded to a few thousand directions, and their shades interpolated), so
           its lit pictures converge to others than ours, and these errors are what its way of integrating costs.
    ours: by kind of the peer, because pictures are compared in the peer's number of bits.
    """

    scene: Scene
    theirs: dict[str, list[Point]] = field(default_factory=dict)
    unlit: dict[float, float] = field(default_factory=dict)
    ours: dict[str, list[Point]] = field(default_factory=dict)
    matches: list[Match] = field(default_factory=list)
    pictures: dict[str, Picture] = field(default_factory=dict)

    def advantage(self, kind: str) -> float:
        """The least factor over all steps of the peer, by times that were not taken in turns."""
        return advantage(self.ours[kind], self.theirs[kind])


def compare(scene: Scene, engine: Engine, truth: Picture, say: Callable[[str], None]) -> Comparison:
    """Measure a scene. ``truth``: its reference."""
    result = Comparison(scene, pictures={"reference": truth})
    if scene.lit:
        result.unlit = unlit_errors(scene, engine, say)
    jiggled = cameras(scene)
    peers = {kind: Vtk(scene, kind) for kind in KINDS}
    ours = Ours(scene, engine)
    for kind, peer in peers.items():
        result.theirs[kind] = []
        for step in STEPS:
            rmse, maximum = errors(picture := peer.picture(step), truth)
            seconds = timed(lambda step=step, peer=peer: peer.frame(step, next(jiggled)))
            result.theirs[kind].append(Point({"step": step}, seconds, rmse, maximum))
            if step == 1.0:
                result.pictures[kind] = picture
            say(f"{scene.name}: {kind}, step {step:.3g}: {seconds * 1000:.0f} ms, rmse {rmse:.2e}, max {maximum:.2e}")
    ceiling = max(point.seconds for points in result.theirs.values() for point in points)
    bars = [point.rmse for points in result.theirs.values() for point in points] + list(result.unlit.values())
    for kind, found in our_points(ours, truth, bars, ceiling, jiggled):
        result.ours.setdefault(kind, []).append(found)
        if kind == KINDS[0]:
            say(f"{scene.name}: ours, {found.label}: {found.seconds * 1000:.0f} ms, rmse {found.rmse:.2e}")
    for kind, peer in peers.items():
        for step in TOLD:
            theirs = next(point for point in result.theirs[kind] if point.settings["step"] == step)
            matches = [_match(result, kind, theirs, theirs.rmse, peer, ours, jiggled)]
            if result.unlit and kind == "fixed-point":
                other = _match(result, kind, theirs, result.unlit[step], peer, ours, jiggled)
                matches.append(replace(other, strict=True))
            result.matches += matches
            for match in matches:
                say(_line(match))
    if result.matches and result.matches[0].ours:
        best = next((m.ours for m in result.matches if m.kind == "gpu" and m.theirs.settings["step"] == 1.0), None)
        if best:
            result.pictures["ours"] = ours.picture(best.settings)
    for peer in peers.values():
        peer.close()
    return result


def unlit_errors(scene: Scene, engine: Engine, say: Callable[[str], None]) -> dict[float, float]:
    """Errors of the fixed-point mapper by step, in a scene without its light."""
    plain = replace(scene, name=scene.name.split(",")[0], lit=False)
    truth, peer = Ours(plain, engine).truth(say), Vtk(plain, "fixed-point")
    found = {step: errors(peer.picture(step), truth)[0] for step in STEPS}
    peer.close()
    return found


def our_points(
    ours: Ours, truth: Picture, bars: Sequence[float], ceiling: float, jiggled: Iterator[Camera]
) -> Iterator[tuple[str, Point]]:
    """Points of ours for each kind of peer: of all ladders, the rungs between the errors ``bars`` of the peers.

    A ladder ends where it is more accurate than any peer, or slower than ``ceiling`` seconds.
    """
    for ladder in ladders():
        for settings in ladder:
            picture = ours.picture(settings)
            exact, maximum = errors(picture, truth)
            if exact > max(bars):
                continue
            seconds = timed(lambda settings=settings: ours.frame(settings, next(jiggled)))
            rounded = {kind: errors(picture, truth, BITS[kind])[0] for kind in KINDS}
            for kind in KINDS:
                yield kind, Point(settings, seconds, rounded[kind], maximum)
            # Near the limit of their bits a finer step is still a little better.
            if (exact < 0.3 * min(bars) and max(rounded.values()) <= min(bars)) or seconds > ceiling:
                break


def _match(
    found: Comparison, kind: str, theirs: Point, bar: float, peer: Vtk, ours: Ours, jiggled: Iterator[Camera]
) -> Match:
    """Time one picture of VTK's in turns with the most promising of ours whose error is at most ``bar``."""
    step = theirs.settings["step"]
    promising = cheapest(found.ours[kind], bar, CANDIDATES)
    cast = cheapest([point for point in found.ours[kind] if is_whole(point)], bar, CANDIDATES)
    candidates = promising + [point for point in cast if point not in promising]
    actions: dict[str, Callable[[], object]] = {"theirs": lambda: peer.frame(step, next(jiggled))}
    for i, candidate in enumerate(candidates):
        actions[str(i)] = lambda candidate=candidate: ours.frame(candidate.settings, next(jiggled))
    taken = interleaved(actions)
    timed_again = [replace(candidate, seconds=taken[str(i)]) for i, candidate in enumerate(candidates)]
    timed_again.sort(key=lambda point: point.seconds)
    best, whole = next(iter(timed_again), None), next(filter(is_whole, timed_again), None)
    return Match(found.scene, kind, replace(theirs, seconds=taken["theirs"]), bar, best, whole)


def is_whole(point: Point) -> bool:
    """Whether the ray of every pixel is cast."""
    return "level" not in point.settings and "pixel_tolerance" not in point.settings


def cameras(scene: Scene) -> Iterator[Camera]:
    """Cameras that are all different, so that nobody shows a picture that is kept, and none by more than a hair."""
    for i in itertools.count(1):
        yield scene.seen_from(1e-6 * i)


def _line(match: Match) -> str:
    theirs, ours = match.theirs, match.ours
    told = (
        f"{ours.label}: {ours.seconds * 1000:.0f} ms, rmse {ours.rmse:.2e}"
        if ours
        else "nothing of ours is as accurate"
    )
    return (
        f"{match.scene.name}: {match.kind}, {theirs.label}: {theirs.seconds * 1000:.0f} ms, rmse {match.bar:.2e} | "
        f"{told} | {match.factor:.2f} x, wanted {match.wanted:g} x, {match.whole_factor:.2f} x with every ray"
    )


def fronts_hold(comparisons: Sequence[Comparison]) -> bool:
    """Whether our front lies below VTK's everywhere."""
    return all(found.advantage(kind) > 1.0 for found in comparisons for kind in KINDS)
