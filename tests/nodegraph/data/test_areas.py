"""Areas over value and gradient magnitude as kernels read them, and the bricks in which they can be seen."""

import numpy as np
import pytest

from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid
from nodegraph.data.areas import areas
from nodegraph.data.bricks import Flags, visible_by_areas

RED = (0.9, 0.1, 0.2)
FUNCTION = TransferFunction2D(
    [
        Trapezoid((100.0, 300.0), (150.0, 200.0), (0.0, 40.0), 0.5, RED, 0.3),
        Trapezoid.rectangle((300.0, 400.0), (5.0, 6.0), RED, 0.2),
        Gaussian((700.0, 10.0), (20.0, 2.0), RED, 0.4),
    ],
    reference_length=2.0,
)


def test_rows_say_what_an_area_is():
    rows = areas(FUNCTION, 50.0).reshape(3, 4, 4)
    assert np.allclose(rows[:, 0, 3], -np.log1p([-0.3, -0.2, -0.4]) / 2.0)
    assert np.allclose(rows[:, 0, :3], RED)
    assert rows[:, 1].tolist() == [[50, 250, 0, 40], [250, 350, 5, 6], [590, 710, 4, 16]]
    assert rows[:, 2].tolist() == [[50, 250, 100, 150], [250, 350, 250, 350], [650, 10, 0.05, 0.5]]
    assert rows[:, 3].tolist() == [[0, 1 / 40, 0.5, 0], [5, 1, 0, 1], [0, 0, -1, 0]]


def test_without_areas_there_is_one_that_is_nowhere():
    rows = areas(TransferFunction2D())
    assert rows.shape == (4, 4)
    assert rows[0, 3] == 0.0
    assert rows[1, 1] < rows[1, 0] or rows[1, 3] < 0.0


@pytest.mark.parametrize("narrow", [1e-300, 1e-40])
def test_what_is_too_narrow_for_single_precision_stays_finite(narrow):
    function = TransferFunction2D(
        [Gaussian((0.0, 0.0), (narrow, narrow), RED, 0.5), Trapezoid.rectangle((0.0, narrow), (0.0, narrow), RED, 0.5)]
    )
    with np.errstate(over="raise"):
        assert np.isfinite(areas(function).astype(np.float32)).all()


def brute(ranges, function, threshold):
    """By every value at which something may change, and one in between."""
    ends = sorted({value for area in function.areas for value in area.bounds[0]})
    found: Flags = np.zeros(len(ranges), bool)
    for i, (low, high) in enumerate(ranges):
        places = [value for value in (low, high, *ends) if low <= value <= high]
        places += [0.5 * (a + b) for a, b in zip(sorted(places), sorted(places)[1:], strict=False)]
        for value in places:
            most = sum(
                function.extinction(area.opacity)
                for area in function.areas
                if area.bounds[0][0] <= value <= area.bounds[0][1]
            )
            found[i] |= bool(most > threshold)
    return found


@pytest.mark.parametrize("threshold", [0.0, 0.12, 0.2, 0.27, 0.4])
def test_bricks_are_seen_where_an_area_may_be(threshold):
    """0.178, 0.112 and 0.255 per mm; 0.290 where the first two touch, which is at one value only."""
    rng = np.random.default_rng(3)
    ends = np.sort(rng.choice([0.0, 99.0, 100.0, 250.0, 300.0, 301.0, 400.0, 640.0, 650.0, 760.0, 761.0], (400, 2)))
    nothing = np.array([[np.inf, -np.inf], [-np.inf, np.inf]])
    ranges = np.concatenate([ends, nothing])
    expected = brute(ranges, FUNCTION, threshold)
    expected[-2:] = False, threshold < 0.29
    assert np.array_equal(visible_by_areas(ranges, FUNCTION, threshold), expected)
    assert 0 < expected.sum() < len(expected) or threshold == 0.4
    assert not visible_by_areas(ranges, TransferFunction2D()).any()
