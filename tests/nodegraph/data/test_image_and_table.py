"""Pictures and tables."""

import numpy as np
import pytest

from nodegraph.data import Buffer, Image, Table
from nodegraph.errors import PortError

RGBA = np.zeros((2, 3, 4), np.float32)


def test_size_is_width_and_height():
    image = Image(RGBA, np.zeros((2, 3), np.float32))
    assert image.size == (3, 2)
    assert image.channels == 4
    assert "depth" in image.summary()
    assert Image(np.zeros((2, 3), np.float32)).channels == 1


def test_over_a_background():
    image = Image(np.array([[[0.25, 0.0, 0.0, 0.5]]], np.float32))
    assert image.over((1.0, 0.5, 0.0)).tolist() == [[[0.75, 0.25, 0.0]]]
    with pytest.raises(PortError, match="alpha"):
        Image(np.zeros((1, 1, 2), np.float32)).over((0, 0, 0))


def test_nothing_is_fetched_to_know_the_size():
    buffer = Buffer.on_device((2, 3, 4), "f4", lambda: pytest.fail("nobody asked for the data"))
    image = Image(buffer)
    assert (image.size, image.nbytes, image.color_buffer) == ((3, 2), 96, buffer)
    assert image.with_color(RGBA).depth is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((2, 3, 3), np.float32),), "expected reals"),
        ((np.zeros((2, 3, 4), np.uint8),), "expected reals"),
        ((np.zeros((0, 3, 4), np.float32),), "empty"),
        ((RGBA, np.zeros((3, 2), np.float32)), "depth has shape"),
        ((RGBA, np.zeros((2, 3), np.int32)), "depth in reals"),
        ((RGBA, None, np.zeros((2, 3), np.float32)), "ids in uint32"),
        ((RGBA, None, np.zeros((2, 2), np.uint32)), "ids has shape"),
    ],
)
def test_what_is_no_picture_is_refused(arguments, message):
    with pytest.raises(PortError, match=message):
        Image(*arguments)


def test_a_notebook_is_shown_a_png_and_no_distances():
    assert Image(RGBA)._repr_png_().startswith(b"\x89PNG")
    assert Image(np.zeros((2, 3, 2), np.float32))._repr_png_() is None


def test_rows_of_a_table():
    table = Table({"organ": ["liver", "spleen"], "ml": np.array([1500.0, 200.0])}, {"ml": "ml"})
    assert len(table) == 2
    assert table.columns == ("organ", "ml")
    assert table.rows()[1] == {"organ": "spleen", "ml": 200.0}
    assert len(Table({})) == 0
    with pytest.raises(PortError, match="one length"):
        Table({"a": [1], "b": [1, 2]})
    with pytest.raises(PortError, match="must hold numbers or text"):
        Table({"a": [object()]})
