"""Reading volumes through the processor, and the volumes that come with the repository."""

import importlib.util
import os
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from nodegraph import formats
from nodegraph.data import Image, Labels, Mapping, Volume
from nodegraph.data.space import transform_points
from nodegraph.errors import FormatError, ParameterError
from tests.support.calls import call

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = {
    "cta_chest.nii.gz": ((233, 167, 191), "int16", (1.5, 1.5, 1.5), (-1088.0, 3344.0)),
    "cta_chest_heart.nii.gz": ((233, 167, 191), "uint8", (1.5, 1.5, 1.5), (0.0, 1.0)),
    "mni152.nii.gz": ((197, 233, 189), "uint8", (1.0, 1.0, 1.0), (0.0, 255.0)),
    "nuclei.nrrd": ((128, 128, 60), "uint16", (0.00026, 0.00026, 0.00029), (0.0, 59892.0)),
    "nuclei_labels.nrrd": ((128, 128, 60), "uint8", (0.00026, 0.00026, 0.00029), (0.0, 14.0)),
    "brainsmall.nrrd": ((128, 128, 84), "uint8", (1.0, 1.0, 1.0), (0.0, 202.0)),
}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_volumes(name):
    dims, dtype, spacing, values = SHIPPED[name]
    volume = call("source.volume", path=str(ROOT / "workspaces" / "data" / name))
    assert (volume.dims, volume.dtype.name, volume.range) == (dims, dtype, values)
    assert np.allclose(volume.spacing, spacing, rtol=1e-12)


def test_what_ships_is_small_and_has_terms():
    folder = ROOT / "workspaces" / "data"
    files = [path for path in folder.iterdir() if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 12e6
    terms, table = (folder / "LICENSES.md").read_text(), (folder / "README.md").read_text()
    for path in files:
        if path.name.endswith((".nii.gz", ".nrrd")):
            assert path.name in SHIPPED
            assert path.name in terms, f"{path.name}: say under which terms it is"
            assert path.name in table


def test_the_heart_lies_in_the_chest():
    """The label's voxels hold blood with contrast agent and muscle: well above water, below bone."""
    chest = formats.read(ROOT / "workspaces" / "data" / "cta_chest.nii.gz")
    heart = formats.read_labels(ROOT / "workspaces" / "data" / "cta_chest_heart.nii.gz")
    assert np.array_equal(chest.index_to_world, heart.index_to_world)
    values = chest.data[heart.data > 0]
    assert 50 < np.median(values) < 500
    assert len(values) * chest.spacing.prod() / 1000 == pytest.approx(700, abs=400), "ml"


def test_the_heart_is_left_and_in_front():
    """LPS: x to the patient's left, y to the back."""
    heart = formats.read_labels(ROOT / "workspaces" / "data" / "cta_chest_heart.nii.gz")
    z, y, x = np.nonzero(heart.data)
    world = transform_points(heart.index_to_world, [x.mean(), y.mean(), z.mean()])
    assert world[0] > heart.centre[0] + 10
    assert world[1] < heart.centre[1] - 10


def test_the_chest_was_reduced_as_its_note_says(rng):
    """What is denser than -500 HU keeps its value within 1, air that touches it within 8; the rest is flat."""
    spec = importlib.util.spec_from_file_location("make_cta_chest", ROOT / "workspaces" / "data" / "make_cta_chest.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    original = np.where(rng.random((12, 12, 12)) < 0.01, 100, -900) + rng.integers(-40, 40, (12, 12, 12))
    reduced = script.reduce(original).astype(int)
    dense = original >= -500
    beside = ndimage.maximum_filter(dense, 3) & ~dense
    assert np.abs(reduced - original)[dense].max() <= 1
    assert np.abs(reduced - original)[beside].max() <= 8
    far = ~dense & ~beside
    assert dense.any()
    assert beside.any()
    assert far.any()
    assert (reduced[far] == -1000).all()


@pytest.fixture
def vectors(tmp_path, rng):
    volume = Volume(
        rng.normal(size=(2, 3, 4, 3)).astype(np.float32), np.diag([1.0, 2.0, 3.0, 1.0]), Mapping(unit="m/s")
    )
    formats.write(volume, tmp_path / "v.npz")
    return volume, str(tmp_path / "v.npz")


def test_one_component(vectors):
    volume, path = vectors
    assert np.array_equal(call("source.volume", path=path).data, volume.data)
    one = call("source.volume", path=path, component=1)
    assert one.components == 1
    assert np.array_equal(one.data, volume.data[..., 1])
    assert np.array_equal(one.index_to_world, volume.index_to_world)
    assert one.mapping == volume.mapping
    with pytest.raises(ParameterError, match=r"component: 3 is outside -1\.\.2"):
        call("source.volume", path=path, component=3)


def test_time_steps(tmp_path, rng):
    series = rng.normal(size=(3, 2, 3, 4, 1)).astype(np.float32)
    np.save(tmp_path / "a.npy", series)
    assert np.array_equal(call("source.volume", path=str(tmp_path / "a.npy"), time=2).data, series[2])
    with pytest.raises(FormatError, match="time: step 3"):
        call("source.volume", path=str(tmp_path / "a.npy"), time=3)


def test_a_fourth_axis_of_components(tmp_path):
    import nibabel

    data = np.arange(2 * 3 * 4 * 6, dtype=np.float32).reshape(2, 3, 4, 6)
    nibabel.save(nibabel.Nifti1Image(data, np.eye(4)), tmp_path / "t.nii")
    path = str(tmp_path / "t.nii")
    assert call("source.volume", path=path).components == 1
    tensor = call("source.volume", path=path, fourth_axis="components")
    assert np.array_equal(tensor.data, data.transpose(2, 1, 0, 3))


def test_another_unit_of_length(vectors):
    volume, path = vectors
    scaled = call("source.volume", path=path, length_scale=1000.0)
    assert scaled.spacing.tolist() == [1000.0, 2000.0, 3000.0]
    assert np.array_equal(scaled.data, volume.data)


def test_refusals(tmp_path):
    with pytest.raises(ParameterError, match="path: no file is chosen"):
        call("source.volume")
    with pytest.raises(FormatError, match="there is no such file"):
        call("source.volume", path=str(tmp_path / "a.nii"))
    formats.write(Image(np.zeros((2, 2, 4), np.float32)), tmp_path / "a.png")
    with pytest.raises(ParameterError, match="holds Image, not a volume"):
        call("source.volume", path=str(tmp_path / "a.png"))


def more_real_data():
    """A test, where NODEGRAPH_DATA names a folder of volumes from other scanners and programs that do not ship."""
    folder = Path(os.environ["NODEGRAPH_DATA"])
    ct = call("source.volume", path=str(folder / "ct_abdomen_labels" / "ct_122x101x112_3mm.nii.gz"))
    labels = formats.read_labels(folder / "ct_abdomen_labels" / "label_117classes.nii.gz")
    assert isinstance(labels, Labels)
    assert np.array_equal(ct.index_to_world, labels.index_to_world)
    assert labels.data.max() <= 117
    report = call("source.volume", path=str(folder / "ct_abdomen_labels" / "rgb24_2D_report_image.nii.gz"))
    assert (report.components, report.dims[2], report.dtype.name) == (3, 1, "uint8")
    tensor = call(
        "source.volume",
        path=str(folder / "dti" / "DERIVED_dti_tensor_xx_xy_xz_yy_yz_zz.nii.gz"),
        fourth_axis="components",
    )
    assert (tensor.components, tensor.dims) == (6, (73, 87, 73))
    assert call("source.volume", path=str(folder / "bonsai" / "bonsai.nii.gz")).dims == (256, 256, 256)


if "NODEGRAPH_DATA" in os.environ:
    test_more_real_data = more_real_data
