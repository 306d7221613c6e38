"""Networks that are offered for a data file: what the file is taken for, and that each of them shows something."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nodegraph import formats, locations, offers, workspace
from nodegraph.data import Image, Labels, TransferFunction, Volume
from nodegraph.errors import FormatError

DATA = locations.workspaces() / "data"
KINDS = {
    "brainsmall.nrrd": "field",
    "cta_chest.nii.gz": "ct",
    "cta_chest_heart.nii.gz": "labels",
    "mni152.nii.gz": "field",
    "nuclei.nrrd": "field",
    "nuclei_labels.nrrd": "labels",
}


def test_every_shipped_data_set_has_its_test() -> None:
    assert {path.name for path in DATA.iterdir() if path.suffix in (".nrrd", ".gz")} == set(KINDS)


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_what_a_shipped_file_is_taken_for_and_that_each_network_shows_it(name: str) -> None:
    assert offers.survey(DATA / name).kind == KINDS[name]
    found = offers.offers(DATA / name)
    assert len({offer.title for offer in found}) == len(found) >= 2
    for offer in found:
        network = offer.network()
        assert network.history.undo_name  # made of commands, as by hand
        pictures = network.run(size=(32, 32))
        assert len(pictures) == (3 if offer.name in ("slices", "labels") else 1)
        for picture in pictures.values():
            assert isinstance(picture, Image)
            assert np.isfinite(picture.color).all()
            inside = picture.color[8:24, 8:24, :3]
            assert inside.std() > 0.01, (name, offer.name)
        again = workspace.loads(workspace.dumps(network))
        assert workspace.dumps(again) == workspace.dumps(network)


def written(path: Path, data: np.ndarray) -> Path:
    formats.write(Volume(data), path)
    return path


def test_labels_are_told_from_fields_by_their_patches(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 5, (12, 16, 16)).astype(np.uint8)
    assert offers.survey(written(tmp_path / "noise.nrrd", noise)).kind == "field"
    patches = np.repeat(np.repeat(noise[:, :4, :4], 4, 1), 4, 2)
    assert offers.survey(written(tmp_path / "patches.nrrd", patches)).ids == (1, 2, 3, 4)
    assert offers.survey(written(tmp_path / "real.nrrd", patches.astype("f4"))).kind == "field"


def test_each_label_has_a_colour_and_what_lies_between_has_none(tmp_path: Path) -> None:
    ids = np.zeros((4, 8, 8), np.uint16)
    ids[:, 2:4], ids[:, 4:6], ids[:, 6:] = 1, 2, 700
    formats.write(Labels(ids), tmp_path / "ids.nrrd")
    network = offers.offer("labels", tmp_path / "ids.nrrd").network()
    function = network.get("axial.transfer_function")
    assert isinstance(function, TransferFunction)
    rows = function.evaluate([0.0, 1.0, 2.0, 300.0, 700.0])
    assert (rows[[0, 3], 3] == 0.0).all()
    assert (rows[[1, 2, 4], 3] > 1.0).all()
    assert len({tuple(row[:3].round(3)) for row in rows[[1, 2, 4]]}) == 3


@pytest.mark.parametrize(
    ("data", "least"),
    [
        (np.zeros((3, 4, 5), "f4"), 4),
        (np.full((1, 1, 1), 7, "i2"), 2),
        (np.random.default_rng(1).random((6, 5, 4, 3), dtype="f4"), 4),
        (np.where(np.arange(60).reshape(3, 4, 5) % 2, np.nan, 1.0).astype("f4"), 4),
    ],
)
def test_odd_volumes_get_networks_that_run(tmp_path: Path, data: np.ndarray, least: int) -> None:
    path = tmp_path / "9 odd name!.npy"
    formats.write(Volume(data), path)
    found = offers.offers(path)
    assert len(found) >= least
    for offer in found:
        for picture in offer.network().run(size=(8, 8)).values():
            assert picture.color.shape == (8, 8, 4)


def test_what_holds_no_volume_is_refused_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "broken.nii.gz").write_bytes(b"no")
    formats.write(Image(np.zeros((2, 2, 4), "f4")), tmp_path / "picture.png")
    formats.write(Volume(np.full((2, 2, 2), np.nan, "f4")), tmp_path / "empty.nrrd")
    for name in ("broken.nii.gz", "picture.png", "empty.nrrd", "missing.nrrd", "notes.txt"):
        with pytest.raises(FormatError, match=name) as caught:
            offers.offers(tmp_path / name)
        assert "\n" not in str(caught.value)
    with pytest.raises(FormatError, match=r"nothing called 'slice' .*did you mean 'slices'"):
        offers.offer("slice", DATA / "nuclei.nrrd")


@pytest.mark.parametrize("name", ["Schädel_größer.npy", "头部.npy", "7 \u00e9t\u00e9s.npy"])
def test_a_file_may_be_named_in_any_script(tmp_path: Path, name: str) -> None:
    path = written(tmp_path / name, np.random.default_rng(0).random((6, 6, 6)).astype(np.float32))
    for offer in offers.offers(path):
        assert offer.network().nodes


@pytest.mark.parametrize("values", [(-1.7e308, 1.7e308), (1.0, 1.0 + 2**-52), (0.0, 5e-324)])
def test_values_at_the_ends_of_double_precision_are_parted(tmp_path: Path, values: tuple[float, float]) -> None:
    data = np.resize(np.array(values), (8, 8, 8))
    nature = offers.survey(written(tmp_path / "field.npy", data))
    assert nature.low < nature.high
    assert nature.low <= nature.threshold <= nature.high
