"""Transfer functions as bands of values: exact integrals, steps without room, and the search of the kernel."""

import numpy as np
import pytest

from nodegraph.data import TransferFunction
from nodegraph.data.bands import FARTHEST, bands

A, B, C = (0.9, 0.2, 0.1), (0.1, 0.8, 0.3), (0.0, 0.5, 1.0)


def found(rows, steps, value):
    """What a kernel does: halving over the first value of each band."""
    band = 0
    for i in range(steps):
        following = band + (1 << (steps - 1 - i))
        band = following if rows[4 * following + 3, 0] <= value else band
    return band


def matter(rows, band, value):
    first, last, _, (start, end, *_) = rows[4 * band : 4 * band + 4]
    return first + (last - first) * np.clip((value - start) / (end - start), 0, 1) if end > start else first


@pytest.mark.parametrize(
    "keys",
    [
        [],
        [(3.0, A, 0.2)],
        [(1.0, A, 0.1), (1.0, B, 0.4)],
        [(0.0, A, 0.0), (1.0, B, 0.5), (1.0, C, 0.9), (4.0, A, 0.2)],
        [(-2.0, A, 0.3), (-2.0, B, 0.1), (5.0, C, 0.2), (5.0, A, 0.7)],
        [(i / 7, A if i % 2 else B, 0.1) for i in range(9)],
    ],
)
@pytest.mark.parametrize("level", [0.0, -1000.0])
def test_they_are_the_function_at_every_value(keys, level):
    function = TransferFunction(keys)
    rows, steps = bands(function, level)
    assert rows.shape == (4 * (2**steps + 1), 4)
    values = np.concatenate([np.linspace(-4, 7, 200), [key[0] for key in keys], [-1e30, 1e30]])
    for value in values:
        band = found(rows, steps, value - level)
        assert np.allclose(matter(rows, band, value - level), function.evaluate(value), atol=1e-12)


def test_integrals_are_exact_and_steps_take_no_room():
    function = TransferFunction([(0.0, A, 0.1), (1.0, B, 0.5), (1.0, C, 0.9), (4.0, A, 0.2)])
    rows = bands(function)[0].reshape(-1, 4, 4)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    total = np.zeros(4)
    assert np.array_equal(rows[0, 2], total)
    for band, (low, high) in enumerate([(0.0, 1.0), (1.0, 4.0)], 1):
        assert rows[band, 3, :2].tolist() == [low, high]
        assert np.allclose(rows[band, 2], total, atol=1e-12)
        matter = function.evaluate(low + (high - low) * (nodes + 1) / 2)
        matter[:, :3] *= matter[:, 3:]
        total = total + (high - low) / 2 * weights @ matter
    assert np.allclose(rows[3, 2], total, atol=1e-12)
    assert np.allclose(rows[4, 2], total, atol=1e-12)  # the kernel reads one band further
    assert (rows[4:, 3, 0] == FARTHEST).all()


def test_jumps_are_told_on_both_sides_of_them():
    function = TransferFunction([(0.0, A, 0.1), (1.0, B, 0.5), (1.0, B, 0.9), (4.0, A, 0.2)])
    rows = bands(function)[0].reshape(-1, 4, 4)
    jump = float(function.extinction(0.9) - function.extinction(0.5))
    assert rows[:4, 3, 3] == pytest.approx([0.0, jump, 0.0, 0.0])
    assert rows[:4, 3, 2] == pytest.approx([0.0, 0.0, jump, 0.0])
    colors = bands(TransferFunction([(0.0, A, 0.5), (1.0, A, 0.5), (1.0, B, 0.5), (2.0, B, 0.5)]))[0].reshape(-1, 4, 4)
    assert colors[1, 3, 3] == pytest.approx(0.8 * np.log(2.0))  # of colour alone
