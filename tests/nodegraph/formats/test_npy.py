"""NumPy files and archives."""

import io
import pickle
import zipfile

import numpy as np
import pytest

from nodegraph import formats
from nodegraph.data import Image, Labels, Mapping, Volume
from nodegraph.errors import FormatError
from tests.nodegraph.formats.expected import oblique, turned

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"]


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("dtype", TYPES)
def test_archives_round_trip(tmp_path, rng, dtype, compress):
    volume = Volume(turned(rng, dtype), oblique(rng), Mapping(0.1, -3.0, "HU"))
    formats.write(volume, tmp_path / "a.npz", compress=compress)
    again = formats.read(tmp_path / "a.npz")
    assert again.dtype == volume.dtype
    assert np.array_equal(again.data, volume.data)
    assert np.array_equal(again.index_to_world, volume.index_to_world)
    assert again.mapping == volume.mapping
    told = formats.info(tmp_path / "a.npz")
    assert told["size"] == [5, 4, 3]
    assert np.allclose(told["spacing"], volume.spacing)


def is_mapped(array):
    while array is not None:
        if isinstance(array, np.memmap):
            return True
        array = getattr(array, "base", None)
    return False


def test_uncompressed_data_is_mapped_in_archives_too(tmp_path):
    volume = Volume(np.arange(24, dtype=np.float32).reshape(2, 3, 4))
    for name in ("a.npy", "a.npz"):
        formats.write(volume, tmp_path / name)
        assert is_mapped(formats.read(tmp_path / name).data)
    formats.write(volume, tmp_path / "b.npz", compress=True)
    assert not is_mapped(formats.read(tmp_path / "b.npz").data)


def test_plain_arrays(tmp_path, rng):
    for dtype in TYPES:
        data = turned(rng, dtype)
        np.save(tmp_path / "a.npy", data)
        volume = formats.read(tmp_path / "a.npy")
        assert np.array_equal(volume.data, data)
        assert volume.centre.tolist() == [0.0, 0.0, 0.0]
    np.save(tmp_path / "f.npy", np.asfortranarray(data))
    assert np.array_equal(formats.read(tmp_path / "f.npy").data, data)
    np.save(tmp_path / "big.npy", data.astype(">f8"))
    assert formats.read(tmp_path / "big.npy").dtype.isnative
    np.save(tmp_path / "bool.npy", data > 0)
    assert formats.read(tmp_path / "bool.npy").dtype == np.uint8
    np.save(tmp_path / "long.npy", np.arange(8).reshape(2, 2, 2))
    assert formats.read(tmp_path / "long.npy").dtype == np.int32


def test_time_comes_first_and_components_last(tmp_path, rng):
    series = rng.normal(size=(3, 2, 3, 4, 2))
    np.save(tmp_path / "a.npy", series)
    assert np.array_equal(formats.read(tmp_path / "a.npy", time=2).data, series[2])
    assert formats.info(tmp_path / "a.npy")["times"] == 3
    with pytest.raises(FormatError, match="time"):
        formats.read(tmp_path / "a.npy", time=-1)


def test_a_mapping_is_applied_where_the_file_has_no_place_for_it(tmp_path):
    formats.write(Volume(np.full((2, 2, 2), 7, np.int16), mapping=Mapping(2.0, 1.0)), tmp_path / "a.npy")
    assert (np.load(tmp_path / "a.npy") == 15.0).all()


def test_spacing_and_origin_beside_the_data(tmp_path):
    np.savez(tmp_path / "a.npz", anything=np.zeros((2, 3, 4), np.uint8))
    assert formats.read(tmp_path / "a.npz").spacing.tolist() == [1.0, 1.0, 1.0]
    np.savez(tmp_path / "a.npz", data=np.zeros((2, 3, 4), np.uint8), spacing=[1, 2, 3])
    volume = formats.read(tmp_path / "a.npz")
    assert volume.spacing.tolist() == [1.0, 2.0, 3.0]
    assert volume.centre.tolist() == [0.0, 0.0, 0.0]
    np.savez(tmp_path / "a.npz", data=np.zeros((2, 3, 4), np.uint8), spacing=[1, 2, 3], origin=[7, 8, 9], unit="HU")
    volume = formats.read(tmp_path / "a.npz")
    assert volume.index_to_world[:3, 3].tolist() == [7.0, 8.0, 9.0]
    assert volume.mapping == Mapping(unit="HU")


def test_labels_keep_their_names(tmp_path):
    labels = Labels(np.arange(8, dtype=np.uint32).reshape(2, 2, 2), names={1: "liver", 7: "Milz ä"})
    formats.write(labels, tmp_path / "a.npz")
    again = formats.read_labels(tmp_path / "a.npz")
    assert dict(again.names) == dict(labels.names)
    assert np.array_equal(again.data, labels.data)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_images_are_kept_exactly(tmp_path, rng, dtype):
    image = Image(
        rng.random((3, 4, 4)).astype(dtype), np.full((3, 4), np.inf, dtype), rng.integers(0, 2**32, (3, 4), np.uint32)
    )
    formats.write(image, tmp_path / "a.npz")
    again = formats.read(tmp_path / "a.npz")
    for name in ("color", "depth", "ids"):
        assert getattr(again, name).dtype == getattr(image, name).dtype
        assert np.array_equal(getattr(again, name), getattr(image, name))
    assert formats.info(tmp_path / "a.npz")["kind"] == "Image"


class Trap:
    def __reduce__(self):
        return (pytest.fail, ("unpickled",))


def test_nothing_is_unpickled(tmp_path):
    np.save(tmp_path / "a.npy", np.array([[[Trap()]]], object), allow_pickle=True)
    np.savez(tmp_path / "a.npz", data=np.zeros((2, 2, 2), np.uint8), unit=np.array([Trap()], object))
    (tmp_path / "b.npy").write_bytes(pickle.dumps(Trap()))
    for name in ("a.npy", "a.npz", "b.npy"):
        with pytest.raises(FormatError):
            formats.read(tmp_path / name)


def header(shape, dtype="<f4"):
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    text += " " * (117 - len(text)) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


@pytest.mark.parametrize(
    ("blob", "message"),
    [
        (b"", "no NumPy header"),
        (b"\x93NUMPY\x01\x00", "no NumPy header"),
        (header((4000, 4000, 4000)) + bytes(64), "promises 256000000000 bytes"),
        (header((10**12, 10**12, 10**12)), "promises"),
        (header((0, 3, 4)), "empty"),
        (header((2, 3)) + bytes(24), r"expected \(z, y, x\)"),
        (header((1, 1, 1), "<c8") + bytes(8), "complex"),
        (header((1, 1, 1), "<U2") + bytes(8), "dtype"),
        (header("__import__('os')"), "no NumPy header"),
    ],
)
def test_refusals(tmp_path, blob, message):
    (tmp_path / "a.npy").write_bytes(blob)
    with pytest.raises(FormatError, match=message):
        formats.read(tmp_path / "a.npy")


def test_archives_that_lie(tmp_path):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data.npy", header((2000, 2000, 2000)) + bytes(64))
    with pytest.raises(FormatError, match="cannot hold"):
        formats.read(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data.npy", header((20, 20, 20)) + bytes(64))
    with pytest.raises(FormatError, match="cut short"):
        formats.read(path)
    small = io.BytesIO()
    np.save(small, np.zeros(1 << 18))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data.npy", header((1, 1, 1)) + bytes(4))
        archive.writestr("spacing.npy", small.getvalue())
    with pytest.raises(FormatError, match="spacing: 2097280 bytes are too many"):
        formats.read(path)
    np.savez(path, one=np.zeros((2, 2, 2)), two=np.zeros((2, 2, 2)))
    with pytest.raises(FormatError, match="the archive holds one, two"):
        formats.read(path)
    np.savez(path, data=np.zeros((2, 2, 2)), index_to_world=np.full((4, 4), np.nan))
    with pytest.raises(FormatError, match="index_to_world"):
        formats.read(path)
    formats.write(Volume(np.ones((9, 9, 9))), path, compress=True)
    blob = bytearray(path.read_bytes())
    blob[150] ^= 0xFF
    path.write_bytes(blob)
    with pytest.raises(FormatError):
        formats.read(path)
