"""What a frame costs by the size of the volume and of the picture, at the same step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nodegraph.engine import Engine
from tests.benchmarks.measure import interleaved
from tests.benchmarks.peers.compare import cameras
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.scenes import Scene, bones, fog
from tests.benchmarks.peers.vtk_peer import KINDS, Vtk

SIDES = (64, 128, 256, 512)
PICTURES = (256, 512, 1024, 2048)
SETTINGS = {"integrator": "midpoint", "step": 1.0, "termination": 0.999}
ROUNDS = 3


@dataclass(frozen=True)
class Cost:
    """Seconds of a frame by renderer ("ours", "gpu", "fixed-point"); sides in voxels and pixels."""

    scene: str
    side: int
    picture: int
    seconds: dict[str, float]


def costs(engine: Engine, say: Callable[[str], None], largest: int = 1 << 30) -> list[Cost]:
    """Volumes of all sides at 512 x 512 pixels, then pictures of all sizes of 256^3 voxels, none above ``largest``."""
    usual = min(256, largest), min(512, largest)
    shapes = [(side, usual[1]) for side in SIDES if side <= largest]
    shapes += [(usual[0], picture) for picture in PICTURES if picture <= largest and picture != usual[1]]
    result = []
    for make in (bones, fog):
        for side, picture in shapes:
            cost = _cost(make((picture, picture), side), engine)
            say(
                f"{cost.scene}: {side}^3 voxels, {picture}^2 pixels: "
                + ", ".join(f"{who} {seconds * 1000:.0f} ms" for who, seconds in cost.seconds.items())
            )
            result.append(cost)
    return result


def _cost(scene: Scene, engine: Engine) -> Cost:
    jiggled = cameras(scene)
    ours = Ours(scene, engine)
    peers = {kind: Vtk(scene, kind) for kind in KINDS}
    actions: dict[str, Callable[[], object]] = {"ours": lambda: ours.frame(SETTINGS, next(jiggled))}
    for kind, peer in peers.items():
        actions[kind] = lambda peer=peer: peer.frame(SETTINGS["step"], next(jiggled))
    taken = interleaved(actions, ROUNDS)
    for peer in peers.values():
        peer.close()
    return Cost(scene.name, scene.volume.dims[0], scene.size[0], taken)
