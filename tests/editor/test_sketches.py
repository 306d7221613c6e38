"""Small renderings and previews: what is in the middle is in the middle, what is nearer hides what is behind it."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Image, Labels, Mesh, Table, TransferFunction, Volume
from nodegraph.editor import sketches
from nodegraph.editor.previews import TILE, preview_of

pytestmark = pytest.mark.slow


def never() -> bool:
    return False


def ball(n: int = 24, radius: float = 0.6) -> np.ndarray:
    axis = np.linspace(-1.0, 1.0, n)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return (np.sqrt(x * x + y * y + z * z) < radius).astype(np.float32)


def cube(low: float = -10.0, high: float = 10.0) -> Mesh:
    corners = [(x, y, z) for x in (low, high) for y in (low, high) for z in (low, high)]
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return Mesh(corners, faces)


def test_a_ball_is_a_disc_in_the_middle() -> None:
    made = sketches.cast(Volume(ball()), 64, never)
    assert made is not None
    alpha = made[..., 3].astype(float)
    assert alpha[32, 32] > 240
    assert alpha[0].max() == alpha[:, 0].max() == 0
    rows, columns = np.nonzero(alpha > 128)
    assert abs(rows.mean() - 31.5) < 1.5
    assert abs(columns.mean() - 31.5) < 1.5
    assert 26 < np.sqrt(len(rows) / np.pi) < 31  # it fills the picture


def test_it_looks_from_the_front_right_and_above() -> None:
    """What lies to the patient's left is on the right, and what is up is above."""
    for axis in (2, 0):
        data = np.zeros((24, 24, 24), np.float32)
        at = [slice(9, 15)] * 3
        for part, value in ((slice(0, 6), 0.5), (slice(18, 24), 1.0)):
            at[axis] = part
            data[tuple(at)] = value
        made = sketches.cast(Volume(data), 64, never)
        assert made is not None
        bright = made[..., :3].sum(axis=2) * (made[..., 3] > 200)
        rows, columns = np.nonzero(bright > 0.75 * bright.max())
        assert columns.mean() > 36 if axis == 2 else rows.mean() < 28


def test_labels_keep_their_colours() -> None:
    made = sketches.cast(Labels((ball() * 3).astype(np.uint8)), 48, never)
    assert made is not None
    color = sketches.label_colors(np.array([3]))[0].astype(float)
    seen = made[24, 24, :3].astype(float)
    assert np.abs(seen / seen.max() - color / color.max()).max() < 0.05
    assert (sketches.label_colors(np.array([0])) == 0).all()
    assert len({tuple(c) for c in sketches.label_colors(np.arange(1, 60))}) == 59


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 5, 9), (3, 1, 200)])
def test_thin_volumes_and_nonsense_are_drawn(shape: tuple[int, int, int]) -> None:
    data = np.arange(np.prod(shape), dtype=np.float32).reshape(shape)
    data.flat[0] = np.nan
    made = preview_of(Volume(data))
    assert made.picture is not None
    assert preview_of(Volume(np.full(shape, np.inf, np.float32))).picture is not None


def test_a_cube_has_no_holes_and_three_shades() -> None:
    made = sketches.draw(cube(), 96, never)
    assert made is not None
    inside = made[40:56, 40:56, 3]
    assert (inside == 255).all()
    shades = np.unique(made[made[..., 3] == 255][:, 1])
    assert len(shades) == 3


def test_the_nearer_hides_the_farther() -> None:
    near = np.array(cube(-2, 2).vertices) - 12 * sketches.FORWARD
    both = Mesh(
        np.concatenate([cube().vertices, near]),
        np.concatenate([cube().triangles[:2], cube().triangles[8:10] + 8]),
    )
    made = sketches.draw(both, 64, never)
    other = sketches.draw(Mesh(both.vertices, both.triangles[::-1]), 64, never)
    assert made is not None
    assert other is not None
    assert (made == other).mean() > 0.995


def test_it_stops_when_it_is_told_to() -> None:
    assert sketches.cast(Volume(ball()), 32, lambda: True) is None
    assert sketches.draw(cube(), 32, lambda: True) is None
    assert preview_of(Volume(ball()), lambda: True).picture is None


def test_every_type_has_something_to_say() -> None:
    volume = preview_of(Volume(ball()))
    assert volume.picture is not None
    assert volume.picture.width() == volume.picture.height() == 2 * TILE + 3
    image = preview_of(Image(np.full((300, 400, 4), 0.25, np.float32)))
    assert image.lines == ("values 0.25 .. 0.25",)
    assert image.picture is not None
    assert (image.picture.width(), image.picture.height()) == (260, 195)
    assert preview_of(cube()).picture is not None
    table = preview_of(Table({"label": np.arange(9), "volume": np.linspace(0, 1, 9)}, {"volume": "ml"}))
    assert table.rows[0] == ("label", "volume [ml]")
    assert table.rows[2] == ("1", "0.125")
    assert table.rows[-1] == ("\u2026 3 more",)
    assert any(line.startswith("eye") for line in preview_of(Camera()).lines)
    assert preview_of(TransferFunction()).picture is not None
    assert preview_of(3.5) == preview_of("text")
