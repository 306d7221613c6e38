"""What is said and shown of a file: sound ones, broken ones, large ones, ones that are not there."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtWidgets import QFileDialog

from nodegraph import data, formats
from nodegraph.data.space import affine
from nodegraph.editor.parameters import file_look
from nodegraph.editor.parameters.file_look import in_bytes, look_at, look_into
from nodegraph.editor.parameters.file_preview import FilePreview

Z, Y, X = np.indices((6, 20, 40))
VOLUME = data.Volume((X + 100 * (Z == 3)).astype("i2"), affine((1.0, 2.0, 3.0)))


@pytest.mark.parametrize("name", ["a.nii", "a.nii.gz", "a.nrrd", "a.npy"])
def test_a_volume_is_told_and_shown(tmp_path: Path, name: str) -> None:
    formats.write(VOLUME, tmp_path / name)
    look = look_at(tmp_path / name)
    assert look.text.startswith("40x20x6 int16, ")
    if name != "a.npy":
        assert "1x2x3 mm" in look.text
        assert (look.picture.width(), look.picture.height()) == (96, 96), "40 mm square"
    assert look.trouble == ""
    grey = [look.picture.pixelColor(x, 10).red() for x in (2, 48, 93)]
    assert grey[0] < grey[1] < grey[2], "the slice in the middle rises along x"


def test_a_picture_is_told_and_shown(tmp_path: Path) -> None:
    color = np.ones((10, 30, 4), np.float32)
    formats.write(data.Image(color), tmp_path / "a.png")
    look = look_at(tmp_path / "a.png")
    assert look.text.startswith("30x10 8 bit, PNG, ")
    assert (look.picture.width(), look.picture.height()) == (30, 10)


def test_what_is_wrong_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "a.nii").write_bytes(b"nothing")
    (tmp_path / "a.txt").write_text("words")
    formats.write(VOLUME, tmp_path / "b.nii.gz")
    packed = gzip.decompress((tmp_path / "b.nii.gz").read_bytes())
    (tmp_path / "b.nii.gz").write_bytes(gzip.compress(packed[:4000]))
    (tmp_path / "sub").mkdir()
    for name, says in (
        ("a.nii", ""),
        ("a.txt", "no format has the suffix '.txt'"),
        ("b.nii.gz", ""),
        ("c.nii", "not found: c.nii"),
        ("sub", "this is a folder"),
    ):
        look = look_at(tmp_path / name)
        assert look.trouble.startswith(says)
        assert look.trouble
        assert "\n" not in look.trouble
        assert str(tmp_path) not in look.trouble
        assert look.picture is None


def test_a_packed_file_that_would_take_much_memory_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    formats.write(VOLUME, tmp_path / "a.nii.gz")
    formats.write(VOLUME, tmp_path / "a.nii")
    monkeypatch.setattr(file_look, "MOST_BYTES", 1000)
    read: list[Path] = []
    monkeypatch.setattr(formats, "read", lambda path, _read=formats.read, **options: read.append(path) or _read(path))
    look = look_at(tmp_path / "a.nii.gz")
    assert look.text.startswith("40x20x6 int16")
    assert look.picture is None
    assert look_at(tmp_path / "a.nii").picture is not None, "mapped: only the slice is read"
    assert read == [tmp_path / "a.nii"]


def test_a_folder_is_counted(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    assert look_into(tmp_path / "sub").text == "empty"
    (tmp_path / "sub" / "a").write_text("")
    assert look_into(tmp_path / "sub").text == "1 entry"
    assert look_into(tmp_path / "sub" / "a").trouble == "a is a file, not a folder"
    assert look_into(tmp_path / "none").trouble == "not found: none"


def test_bytes_as_a_person_says_them() -> None:
    assert [in_bytes(n) for n in (12, 2_400, 3_000_000, 1_234_000_000)] == ["12 bytes", "2.4 kB", "3 MB", "1.23 GB"]


def test_the_field_shows_it_and_follows_the_value(alone: Any, session: Any, tmp_path: Path, qtbot: Any) -> None:
    formats.write(VOLUME, tmp_path / "a.nii.gz")
    shown = alone("path")
    preview = shown.field.preview
    assert preview.isHidden()
    shown.place.set(str(tmp_path / "a.nii.gz"))
    qtbot.waitUntil(lambda: preview.found.text != "", timeout=5000)
    assert preview.text.text().startswith("40x20x6 int16, 1x2x3 mm")
    assert not preview.picture.pixmap().isNull()
    shown.place.set(str(tmp_path / "gone.nii"))
    qtbot.waitUntil(lambda: preview.trouble.text() == "not found: gone.nii", timeout=5000)
    assert preview.picture.isHidden()
    session.undo()
    qtbot.waitUntil(lambda: preview.found.text != "", timeout=5000)
    shown.place.set("http://elsewhere/a.zarr")
    assert preview.isHidden(), "what lies elsewhere is not opened"


def test_only_the_last_of_many_is_looked_at(session: Any, tmp_path: Path, qtbot: Any) -> None:
    formats.write(VOLUME, tmp_path / "a.nii")
    preview = FilePreview(session, tall=True)
    qtbot.addWidget(preview)
    preview.show()
    for name in ("x.nii", "y.nii", "a.nii"):
        preview.look(tmp_path / name)
    qtbot.waitUntil(lambda: preview.found.text != "", timeout=5000)
    assert preview.found.trouble == ""
    preview.look(None)
    assert preview.found.text == ""
    assert preview.isVisible(), "it keeps its room beside the list"


def test_the_dialog_shows_the_file_that_is_marked(alone: Any, session: Any, tmp_path: Path, qtbot: Any) -> None:
    formats.write(VOLUME, tmp_path / "a.nii")
    shown = alone("path")
    dialog = shown.field.browse()
    (preview,) = dialog.findChildren(FilePreview)
    dialog.currentChanged.emit(str(tmp_path / "a.nii"))
    qtbot.waitUntil(lambda: preview.found.text != "", timeout=5000)
    dialog.fileSelected.emit(str(tmp_path / "a.nii"))
    assert session.network.get("all.path") == str(tmp_path / "a.nii")
    dialog.close()
    folder = alone("folder").field.browse()
    assert isinstance(folder, QFileDialog)
    assert not folder.findChildren(FilePreview)
    folder.close()
