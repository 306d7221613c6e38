"""NRRD against files and readers of others, and against its own claims."""

import bz2
import gzip
import os

import nrrd
import numpy as np
import pytest

from nodegraph import formats
from nodegraph.data import Labels, Mapping, Volume
from nodegraph.errors import FormatError
from tests.nodegraph.formats.expected import FILES, MATRIX, SCALAR, VECTOR, oblique, turned

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]


@pytest.mark.parametrize("name", ["itk_scalar.nrrd", "itk_scalar.nhdr"])
def test_what_itk_wrote(name):
    volume = formats.read(FILES / name)
    assert volume.dtype == np.int16
    assert np.array_equal(volume.data, SCALAR)
    assert np.abs(volume.index_to_world - MATRIX).max() < 1e-12


def test_vectors_of_itk_become_components():
    volume = formats.read(FILES / "itk_vector.nrrd")
    assert np.array_equal(volume.data, VECTOR)
    assert np.abs(volume.index_to_world - MATRIX).max() < 1e-12


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ASCII"])
@pytest.mark.parametrize("dtype", TYPES)
def test_what_pynrrd_wrote(tmp_path, rng, dtype, encoding):
    data = turned(rng, dtype)
    header = {"encoding": encoding, "spacings": [1.0, 2.0, 3.0], "units": ["mm", "cm", "um"]}
    nrrd.write(str(tmp_path / "a.nrrd"), data, header, index_order="C")
    volume = formats.read(tmp_path / "a.nrrd")
    assert volume.dtype == np.dtype(dtype)
    assert np.array_equal(volume.data, data) if encoding != "ASCII" else np.allclose(volume.data, data, rtol=1e-6)
    assert np.allclose(volume.spacing, [1.0, 20.0, 0.003])


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("dtype", TYPES)
def test_round_trip_and_pynrrd_agrees(tmp_path, rng, dtype, compress):
    volume = Volume(turned(rng, dtype), oblique(rng), Mapping(unit="HU"))
    formats.write(volume, tmp_path / "a.nrrd", compress=compress)
    again = formats.read(tmp_path / "a.nrrd")
    assert again.dtype == volume.dtype
    assert np.array_equal(again.data, volume.data)
    assert np.array_equal(again.index_to_world, volume.index_to_world)
    assert again.mapping == volume.mapping
    data, header = nrrd.read(str(tmp_path / "a.nrrd"), index_order="C")
    assert np.array_equal(data, volume.data)
    assert np.array_equal(header["space origin"], volume.index_to_world[:3, 3])


def test_a_mapping_is_applied_where_the_format_has_none(tmp_path):
    formats.write(Volume(np.full((2, 2, 2), 7, np.int16), mapping=Mapping(2.0, 1.0)), tmp_path / "a.nrrd")
    again = formats.read(tmp_path / "a.nrrd")
    assert again.dtype == np.float32
    assert (again.data == 15.0).all()
    exact = Volume(np.full((2, 2, 2), 2**31 - 1, np.int32), mapping=Mapping(0.5, 0.25))
    formats.write(exact, tmp_path / "b.nrrd")
    assert np.array_equal(formats.read(tmp_path / "b.nrrd").data, exact.real(np.float64))


def test_components_and_labels_round_trip(tmp_path, rng):
    volume = Volume(rng.normal(size=(3, 4, 5, 3)).astype(np.float32), oblique(rng))
    formats.write(volume, tmp_path / "a.nrrd")
    again = formats.read(tmp_path / "a.nrrd")
    assert np.array_equal(again.data, volume.data)
    assert np.array_equal(again.index_to_world, volume.index_to_world)
    labels = Labels(np.arange(8, dtype=np.uint32).reshape(2, 2, 2) + 2**31)
    formats.write(labels, tmp_path / "l.nrrd")
    assert np.array_equal(formats.read_labels(tmp_path / "l.nrrd").data, labels.data)


def hand_written(path, data, *lines, magic="NRRD0004"):
    """A file with our own header lines in front of raw little-endian data."""
    path.write_bytes("\n".join([magic, *lines, "", ""]).encode() + data.tobytes())
    return path


SHORT = ("type: short", "endian: little", "encoding: raw")
GRID = (*SHORT, "dimension: 3", "sizes: 4 3 2")
AXES = "space directions: "
DATA = np.arange(24, dtype="<i2").reshape(2, 3, 4)


@pytest.mark.parametrize(
    ("space", "signs"),
    [
        ("left-posterior-superior", (1, 1, 1)),
        ("LPS", (1, 1, 1)),
        ("right-anterior-superior", (-1, -1, 1)),
        ("RAS", (-1, -1, 1)),
        ("left-anterior-superior", (1, -1, 1)),
        ("LAS", (1, -1, 1)),
        ("scanner-xyz", (1, 1, 1)),
    ],
)
def test_spaces_become_lps(tmp_path, space, signs):
    path = hand_written(
        tmp_path / "a.nrrd", DATA, *SHORT, "dimension: 3", "sizes: 4 3 2", f"space: {space}",
        "space directions: (2,0,0) (0,3,0) (0,0,4)", "space origin: (10,20,30)", 'space units: "mm" "mm" "mm"',
    )  # fmt: skip
    expected = np.diag([*signs, 1]) @ [[2, 0, 0, 10], [0, 3, 0, 20], [0, 0, 4, 30], [0, 0, 0, 1]]
    volume = formats.read(path)
    assert np.array_equal(volume.index_to_world, expected)
    assert np.array_equal(volume.data, DATA)


def test_space_units_and_comments_and_keys(tmp_path):
    path = hand_written(
        tmp_path / "a.nrrd", DATA, "# a comment", "content: a test", *SHORT, "dimension: 3", "sizes: 4 3 2",
        "space dimension: 3", "space directions: (2,0,0) (0,3,0) (0,0,4)", "space origin: (1,2,3)",
        'space units: "um" "m" "mm"', "measurement frame: (1,0,0) (0,1,0) (0,0,1)", "key:=value",
    )  # fmt: skip
    assert np.allclose(formats.read(path).spacing, [0.002, 3000.0, 4.0])


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_line_ends(tmp_path, line_end):
    text = line_end.join(["NRRD0004", *SHORT, "dimension: 3", "sizes: 4 3 2", "", ""])
    (tmp_path / "a.nrrd").write_bytes(text.encode() + DATA.tobytes())
    assert np.array_equal(formats.read(tmp_path / "a.nrrd").data, DATA)


@pytest.mark.parametrize("first", [True, False])
def test_components_may_come_first_or_last(tmp_path, first):
    vector = np.arange(72, dtype="<i2").reshape(2, 3, 4, 3)
    kinds, sizes = ("vector domain domain domain", "3 4 3 2") if first else ("domain domain domain list", "4 3 2 3")
    directions = ["(2,0,0)", "(0,3,0)", "(0,0,4)"]
    directions.insert(0 if first else 3, "none")
    stored = vector if first else np.ascontiguousarray(np.moveaxis(vector, -1, 0))
    path = hand_written(
        tmp_path / "a.nrrd", stored, *SHORT, "dimension: 4", f"sizes: {sizes}", f"kinds: {kinds}", "space: LPS",
        f"space directions: {' '.join(directions)}",
    )  # fmt: skip
    volume = formats.read(path)
    assert np.array_equal(volume.data, vector)
    assert volume.spacing.tolist() == [2.0, 3.0, 4.0]


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
def test_a_time_axis(tmp_path, encoding):
    series = np.arange(72, dtype="<i2").reshape(3, 2, 3, 4)
    path = tmp_path / "a.nrrd"
    lines = ["NRRD0004", "type: short", "endian: little", f"encoding: {encoding}", "dimension: 4", "sizes: 4 3 2 3"]
    packed = gzip.compress(series.tobytes()) if encoding == "gzip" else series.tobytes()
    path.write_bytes("\n".join([*lines, "kinds: domain domain domain time", "", ""]).encode() + packed)
    assert formats.info(path)["times"] == 3
    assert np.array_equal(formats.read(path, time=2).data, series[2])
    assert np.array_equal(formats.read(path, fourth_axis="components").data, np.moveaxis(series, 0, -1))
    with pytest.raises(FormatError, match="time"):
        formats.read(path, time=3)


def test_axis_mins_are_the_edge_of_cells_and_the_place_of_nodes(tmp_path):
    common = (*SHORT, "dimension: 3", "sizes: 4 3 2", "spacings: 1 1 1", "axis mins: 10 20 30")
    cells = formats.read(hand_written(tmp_path / "a.nrrd", DATA, *common, "centerings: cell cell cell"))
    nodes = formats.read(hand_written(tmp_path / "b.nrrd", DATA, *common, "centerings: node node node"))
    assert cells.index_to_world[:3, 3].tolist() == [10.5, 20.5, 30.5]
    assert nodes.index_to_world[:3, 3].tolist() == [10.0, 20.0, 30.0]


def test_big_endian_and_skipping(tmp_path):
    lines = ["NRRD0004", "type: int16", "endian: big", "encoding: raw", "dimension: 3", "sizes: 4 3 2"]
    swapped = DATA.astype(">i2").tobytes()
    for skip, front in (("line skip: 2", b"one\ntwo\n"), ("byte skip: 5", b"12345"), ("byte skip: -1", b"whatever")):
        (tmp_path / "a.nrrd").write_bytes("\n".join([*lines, skip, "", ""]).encode() + front + swapped)
        volume = formats.read(tmp_path / "a.nrrd")
        assert volume.dtype.isnative
        assert np.array_equal(volume.data, DATA)


def detached(folder, name, *extra):
    header = ["NRRD0004", *SHORT, "dimension: 3", "sizes: 4 3 2", f"data file: {name}", *extra]
    (folder / "a.nhdr").write_text("\n".join(header) + "\n")
    return folder / "a.nhdr"


def test_detached_data_may_lie_in_a_folder_below(tmp_path):
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "a.raw").write_bytes(DATA.tobytes())
    assert np.array_equal(formats.read(detached(tmp_path, "below/a.raw")).data, DATA)
    (tmp_path / "a.bz2").write_bytes(bz2.compress(DATA.tobytes()))
    path = detached(tmp_path, "a.bz2")
    path.write_text(path.read_text().replace("raw", "bzip2"))
    assert np.array_equal(formats.read(path).data, DATA)


def test_detached_data_stays_in_its_folder(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    secret = tmp_path / "secret.raw"
    secret.write_bytes(DATA.tobytes())
    os.symlink(secret, inside / "link.raw")
    for name in ("../secret.raw", str(secret), "link.raw", "nothing/../../secret.raw"):
        with pytest.raises(FormatError, match="outside the folder"):
            formats.read(detached(inside, name))
    with pytest.raises(FormatError, match=r"no file 'missing\.raw'"):
        formats.read(detached(inside, "missing.raw"))
    for name in ("LIST", "slice%03d.raw 1 9 1"):
        with pytest.raises(FormatError, match="several files"):
            formats.read(detached(inside, name))


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("type: block", "encoding: raw", "dimension: 3", "sizes: 4 3 2"), "type: 'block'"),
        (("type: short", "encoding: raw", "dimension: 3", "sizes: 4 3 2"), "endian: expected little or big"),
        ((*SHORT, "dimension: 3", "sizes: 4 3"), "sizes: 3 axes"),
        ((*SHORT, "dimension: 3", "sizes: 4 3 0"), "sizes:"),
        ((*SHORT, "dimension: 3", "sizes: 4 3 -2"), "sizes:"),
        ((*SHORT, "dimension: 3", "sizes: 4000 3000 2000"), "promises 48000000000 bytes"),
        ((*SHORT, "dimension: 3", f"sizes: 4 3 {10**30}"), "sizes|header"),
        ((*SHORT, "dimension: 3"), "sizes: the header lacks"),
        ((*GRID, "spacings: 1 -1 1"), "spacings: expected lengths"),
        ((*GRID, "spacings: 1 inf 1"), "spacings: expected lengths"),
        ((*GRID, "space: MNI", f"{AXES}(1,0,0) (0,1,0) (0,0,1)"), "space: 'mni'"),
        ((*GRID, "space: LPS", f"{AXES}(1,0,0) (2,0,0) (0,0,1)"), "one plane"),
        ((*GRID, "space: LPS", f"{AXES}(1,0,0) (0,0,0) (0,0,1)"), "space directions"),
        ((*GRID, "space: LPS", f"{AXES}(1,0,0) (0,1,0) (0,0,1)", "space origin: (nan,0,0)"), "space origin"),
        ((*SHORT, "dimension: 4", "sizes: 2 4 3 1", "kinds: complex domain domain domain"), "complex"),
        ((*SHORT, "dimension: 3", "sizes: 4 3 2", "this is no field"), "the header cannot be read"),
        (("type: short", "endian: little", "encoding: hex", "dimension: 3", "sizes: 4 3 2"), "encoding: 'hex'"),
        (("type: short", "encoding: ascii", "dimension: 3", "sizes: 4 3 2"), "numbers"),
    ],
)  # fmt: skip
def test_refusals_name_the_field(tmp_path, lines, message):
    with pytest.raises(FormatError, match=message):
        formats.read(hand_written(tmp_path / "a.nrrd", DATA, *lines))


def test_detached_headers_are_only_read(tmp_path):
    with pytest.raises(FormatError, match=r"write \.nrrd"):
        formats.write(Volume(np.zeros((2, 2, 2), np.uint8)), tmp_path / "a.nhdr")
    assert not list(tmp_path.iterdir())
