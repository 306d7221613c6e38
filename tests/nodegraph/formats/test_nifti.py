"""NIfTI against files and readers of others, and against its own claims."""

import gzip
import tracemalloc

import nibabel
import numpy as np
import pytest

from nodegraph import formats
from nodegraph.data import Labels, Mapping, Volume
from nodegraph.data.space import centred
from nodegraph.errors import FormatError
from tests.nodegraph.formats.expected import FILES, MATRIX, SCALAR, VECTOR, oblique, turned

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]
RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


@pytest.mark.parametrize("name", ["itk_scalar.nii", "itk_scalar.nii.gz"])
def test_what_itk_wrote(name):
    volume = formats.read(FILES / name)
    assert volume.dtype == np.int16
    assert np.array_equal(volume.data, SCALAR)
    assert volume.data.flags.c_contiguous
    assert np.abs(volume.index_to_world - MATRIX).max() < 1e-5, "ITK writes single precision"
    assert volume.mapping == Mapping()


def test_vectors_of_itk_become_components():
    volume = formats.read(FILES / "itk_vector.nii.gz")
    assert volume.components == 3
    assert np.array_equal(volume.data, VECTOR)


def test_a_fourth_axis_is_time_unless_told_otherwise():
    path = FILES / "itk_series.nii.gz"
    for time in range(3):
        assert np.array_equal(formats.read(path, time=time).data, (SCALAR + 7 * time).astype(np.uint8))
    volume = formats.read(path, fourth_axis="components")
    assert volume.components == 3
    assert np.array_equal(volume.data[..., 2], (SCALAR + 14).astype(np.uint8))
    assert formats.info(path)["times"] == 3
    with pytest.raises(FormatError, match=r"time: step 3 is outside 0\.\.2"):
        formats.read(path, time=3)
    with pytest.raises(FormatError, match="fourth_axis"):
        formats.read(path, fourth_axis="depth")


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("dtype", TYPES)
def test_what_nibabel_wrote(tmp_path, rng, dtype, suffix):
    data = turned(rng, dtype)
    matrix = oblique(rng)
    nibabel.save(nibabel.Nifti1Image(data.T, RAS @ matrix, dtype=dtype), tmp_path / f"a{suffix}")
    volume = formats.read(tmp_path / f"a{suffix}")
    assert volume.dtype == np.dtype(dtype)
    assert np.array_equal(volume.data, data)
    assert np.abs(volume.index_to_world - matrix).max() < 1e-4


@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
def test_big_endian_and_the_second_version(tmp_path, rng, kind):
    data = turned(rng, "i2")
    header = kind.header_class(endianness=">")
    header.set_data_dtype(">i2")
    nibabel.save(kind(data.T, np.eye(4), header), tmp_path / "a.nii")
    volume = formats.read(tmp_path / "a.nii")
    assert volume.dtype.isnative
    assert np.array_equal(volume.data, data)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("dtype", TYPES)
def test_round_trip(tmp_path, rng, dtype, suffix):
    matrix = oblique(rng)
    volume = Volume(turned(rng, dtype), matrix, Mapping(0.5, -1024.0))
    formats.write(volume, tmp_path / f"a{suffix}")
    again = formats.read(tmp_path / f"a{suffix}")
    assert again.dtype == volume.dtype
    assert np.array_equal(again.data, volume.data)
    assert np.abs(again.index_to_world - matrix).max() <= 1e-6 * np.abs(matrix).max()
    assert again.mapping == volume.mapping


def test_nibabel_reads_what_we_write(tmp_path, rng):
    """Both ways to say where the voxels lie, for programs that know only one of them; left-handed grids too."""
    for flip in (1.0, -1.0):
        matrix = oblique(rng) @ np.diag([flip, 1.0, 1.0, 1.0])
        volume = Volume(turned(rng, "i2"), matrix, Mapping(2.0, 10.0))
        formats.write(volume, tmp_path / "a.nii.gz")
        image = nibabel.load(tmp_path / "a.nii.gz")
        assert np.abs(image.get_sform() - RAS @ matrix).max() < 1e-4
        assert np.abs(image.get_qform() - RAS @ matrix).max() < 1e-4
        assert image.header.get_xyzt_units()[0] == "mm"
        assert np.allclose(image.get_fdata().T, volume.real(np.float64))


def test_a_sheared_grid_has_no_quaternion(tmp_path):
    matrix = np.array([[1, 0.3, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    formats.write(Volume(np.zeros((2, 2, 2), np.uint8), matrix), tmp_path / "a.nii")
    assert nibabel.load(tmp_path / "a.nii").header["qform_code"] == 0
    assert np.abs(formats.read(tmp_path / "a.nii").index_to_world - matrix).max() < 1e-6


def test_components_round_trip_and_say_so(tmp_path, rng):
    volume = Volume(rng.normal(size=(3, 4, 5, 2)).astype(np.float32))
    formats.write(volume, tmp_path / "a.nii.gz")
    assert np.array_equal(formats.read(tmp_path / "a.nii.gz").data, volume.data)
    assert nibabel.load(tmp_path / "a.nii.gz").header.get_intent()[0] == "vector"


def test_where_single_precision_would_move_voxels_the_second_version_is_written(tmp_path):
    matrix = centred((4, 4, 4), (0.001, 0.001, 0.001))
    matrix[:3, 3] = (1e6, -1e6, 12345.678)
    formats.write(Volume(np.zeros((4, 4, 4), np.uint8), matrix), tmp_path / "a.nii")
    assert formats.info(tmp_path / "a.nii")["format"] == "NIfTI-2"
    assert np.array_equal(formats.read(tmp_path / "a.nii").index_to_world, matrix)
    assert np.allclose(nibabel.load(tmp_path / "a.nii").affine, RAS @ matrix, rtol=1e-12)


@pytest.mark.parametrize(("code", "factor"), [("meter", 1000.0), ("mm", 1.0), ("micron", 0.001), ("unknown", 1.0)])
def test_units_become_millimetres(tmp_path, code, factor):
    image = nibabel.Nifti1Image(np.zeros((2, 3, 4), np.uint8), np.diag([-2.0, -3.0, 4.0, 1.0]))
    image.header.set_xyzt_units(code)
    nibabel.save(image, tmp_path / "a.nii")
    assert np.allclose(formats.read(tmp_path / "a.nii").spacing, np.array([2.0, 3.0, 4.0]) * factor)


def test_the_sform_wins_over_the_qform_and_both_over_the_spacing(tmp_path):
    image = nibabel.Nifti1Image(np.zeros((2, 3, 4), np.uint8), None)
    image.header["pixdim"][1:4] = (2, 3, 4)
    for sform, qform, orientation, x in ((0, 0, "spacing only", -2.0), (0, 1, "qform", -5.0), (2, 1, "sform", -7.0)):
        image.header.set_sform(np.diag([7.0, 7.0, 7.0, 1.0]), sform)
        image.header.set_qform(np.diag([5.0 if qform else 2.0, 3.0, 4.0, 1.0]), qform)
        header = image.header.copy()
        (tmp_path / "a.nii").write_bytes(header.binaryblock + bytes(4) + bytes(24))
        blob = bytearray((tmp_path / "a.nii").read_bytes())
        blob[108:112] = np.float32(352).tobytes()
        blob[344:348] = b"n+1\0"
        (tmp_path / "a.nii").write_bytes(blob)
        volume = formats.read(tmp_path / "a.nii")
        assert formats.info(tmp_path / "a.nii")["orientation"] == orientation
        assert volume.index_to_world[0, 0] == x


def test_scaling_becomes_the_mapping(tmp_path):
    image = nibabel.Nifti1Image(np.arange(24, dtype=np.int16).reshape(2, 3, 4), np.eye(4))
    image.header.set_slope_inter(0.5, -10.0)
    nibabel.save(image, tmp_path / "a.nii")
    volume = formats.read(tmp_path / "a.nii")
    assert volume.mapping == Mapping(0.5, -10.0)
    assert volume.dtype == np.int16
    assert np.allclose(volume.real().T, nibabel.load(tmp_path / "a.nii").get_fdata())


def test_colour_is_read_as_components(tmp_path, rng):
    rgb = rng.integers(0, 255, (4, 5, 6, 3), np.uint8)
    packed = rgb.view([("R", "u1"), ("G", "u1"), ("B", "u1")])[..., 0]
    nibabel.save(nibabel.Nifti1Image(packed, np.eye(4)), tmp_path / "a.nii.gz")
    volume = formats.read(tmp_path / "a.nii.gz")
    assert volume.components == 3
    assert np.array_equal(volume.data, rgb.transpose(2, 1, 0, 3))


def test_one_slice_and_one_time_step_are_volumes(tmp_path):
    nibabel.save(nibabel.Nifti1Image(np.zeros((5, 6), np.uint8), np.eye(4)), tmp_path / "flat.nii")
    nibabel.save(nibabel.Nifti1Image(np.zeros((5, 6, 7, 1), np.uint8), np.eye(4)), tmp_path / "once.nii")
    assert formats.read(tmp_path / "flat.nii").dims == (5, 6, 1)
    assert formats.read(tmp_path / "once.nii").dims == (5, 6, 7)
    assert formats.read(tmp_path / "once.nii").components == 1


def test_64_bit_integers_are_narrowed_where_they_fit(tmp_path):
    def written(high):
        image = nibabel.Nifti1Image(np.array([[[-5, high]]], np.int64), np.eye(4), dtype=np.int64)
        nibabel.save(image, tmp_path / "a.nii")
        return formats.read(tmp_path / "a.nii")

    assert written(2**31 - 1).dtype == np.int32
    with pytest.raises(FormatError, match="float64"):
        written(2**31)


def test_labels_round_trip_and_stored_as_reals(tmp_path):
    ids = np.arange(24).reshape(2, 3, 4)
    formats.write(Labels(ids.astype(np.uint16)), tmp_path / "a.nii.gz")
    assert nibabel.load(tmp_path / "a.nii.gz").header.get_intent()[0] == "label"
    assert formats.info(tmp_path / "a.nii.gz")["labels"] is True
    assert np.array_equal(formats.read_labels(tmp_path / "a.nii.gz").data, ids)
    nibabel.save(nibabel.Nifti1Image(ids.astype(np.float32).T, np.eye(4)), tmp_path / "real.nii")
    assert np.array_equal(formats.read_labels(tmp_path / "real.nii").data, ids)
    nibabel.save(nibabel.Nifti1Image(ids.astype(np.float32).T + 0.5, np.eye(4)), tmp_path / "half.nii")
    with pytest.raises(FormatError, match="whole numbers"):
        formats.read_labels(tmp_path / "half.nii")


def test_uncompressed_data_is_mapped_and_compressed_data_is_held_once(tmp_path):
    data = np.zeros((64, 128, 128), np.int16)
    data[::7, ::5, ::3] = 99
    for name in ("a.nii", "a.nii.gz"):
        formats.write(Volume(data, mapping=Mapping(0.5, 3.0)), tmp_path / name)
        tracemalloc.start()
        volume = formats.read(tmp_path / name)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak <= (0.1 if name == "a.nii" else 1.1) * data.nbytes + 3e6
        assert np.array_equal(volume.data, data)


def test_a_name_does_not_hide_whether_the_data_is_compressed(tmp_path):
    formats.write(Volume(np.ones((2, 2, 2), np.uint8)), tmp_path / "a.nii.gz")
    (tmp_path / "b.nii").write_bytes((tmp_path / "a.nii.gz").read_bytes())
    (tmp_path / "c.nii.gz").write_bytes(gzip.decompress((tmp_path / "a.nii.gz").read_bytes()))
    assert formats.read(tmp_path / "b.nii").data.all()
    assert formats.read(tmp_path / "c.nii.gz").data.all()


def test_the_same_volume_gives_the_same_bytes(tmp_path):
    volume = Volume(np.ones((2, 2, 2), np.uint8))
    formats.write(volume, tmp_path / "a.nii.gz")
    formats.write(volume, tmp_path / "b.nii.gz")
    assert (tmp_path / "a.nii.gz").read_bytes() == (tmp_path / "b.nii.gz").read_bytes()
