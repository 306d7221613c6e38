"""OME-Zarr as ome-zarr and zarr-python write it, versions 2 and 3 of the container, and as it may be damaged."""

import json
import os

import numpy as np
import pytest
import zarr

from nodegraph import formats
from nodegraph.cli import main
from nodegraph.data import Camera, TransferFunction
from nodegraph.errors import FormatError
from nodegraph.fingerprint import file_state
from tests.nodegraph.formats.expected import FILES, VECTOR
from tests.support.calls import call

pytestmark = pytest.mark.slow

UNITS = {"z": "micrometer", "y": "millimeter", "x": "nanometer"}
SPACE = [{"name": n, "type": "space", "unit": UNITS[n]} for n in "zyx"]


@pytest.fixture
def stack():
    """(t, c, z, y, x)"""
    return np.random.default_rng(2).integers(0, 4000, (2, 3, 10, 12, 14)).astype(np.uint16)


def write(path, stack, version=3, axes=None, levels=None, **changes):
    """An OME-Zarr of two resolutions."""
    group = zarr.open_group(path, mode="w", zarr_format=version)
    for level, data in enumerate([stack, stack[..., ::2, ::2, ::2]]):
        group.create_array(str(level), data=data, chunks=(*(1 for _ in data.shape[:-3]), 5, 6, 7))
    rank = stack.ndim
    before = [1.0] * (rank - 3)
    scale = {
        "name": "image",
        "axes": axes or [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}, *SPACE][-rank:],
        "datasets": levels
        or [
            {
                "path": "0",
                "coordinateTransformations": [
                    {"type": "scale", "scale": [*before, 2000.0, 0.5, 250.0]},
                    {"type": "translation", "translation": [0.0] * (rank - 3) + [1000.0, 2.0, 3e6]},
                ],
            },
            {"path": "1", "coordinateTransformations": [{"type": "scale", "scale": [*before, 4000.0, 1.0, 500.0]}]},
        ],
        "coordinateTransformations": [{"type": "scale", "scale": [*before, 1.0, 1.0, 1.0]}],
        **changes,
    }
    if version == 2:
        group.attrs["multiscales"] = [{"version": "0.4", **scale}]
    else:
        group.attrs["ome"] = {"version": "0.5", "multiscales": [scale]}
    return path


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_files_of_ome_zarr(version):
    path = FILES / f"ome_zarr_{version}.ome.zarr"
    volume = formats.read(path)
    assert np.array_equal(volume.data, VECTOR)
    assert volume.dtype == np.int16
    assert np.allclose(volume.index_to_world, np.diag([0.0005, 0.00125, 0.003, 1.0]))
    half = formats.read(path, level=1)
    assert half.dims == (3, 2, 4)
    # Its voxels lie in the middle of those that they stand for.
    assert np.allclose(half.index_to_world[:3, 3], (0.00025, 0.0009375, 0.0))
    assert formats.info(path)["format"] == f"OME-Zarr {version}"


@pytest.mark.parametrize("version", [2, 3])
def test_levels_times_channels_and_place(tmp_path, stack, version):
    path = write(tmp_path / "cells.ome.zarr", stack, version)
    volume = formats.read(path, time=1)
    assert volume.dims == (14, 12, 10)
    assert volume.components == 3
    assert volume.buffer.resident == 0, "nothing was read"
    assert np.array_equal(volume.part((3, 2, 1), (7, 6, 9)).data, np.moveaxis(stack[1], 0, -1)[1:9, 2:6, 3:7])
    assert 0 < volume.buffer.resident < volume.nbytes
    assert np.array_equal(volume.data, np.moveaxis(stack[1], 0, -1))
    # micrometres, millimetres and nanometres are millimetres here
    assert np.allclose(volume.spacing, (0.00025, 0.5, 2.0))
    assert np.allclose(volume.index_to_world[:3, 3], (3.0, 2.0, 1.0))
    coarse = formats.read(path, level=1)
    assert coarse.dims == (7, 6, 5)
    assert np.allclose(coarse.spacing, (0.0005, 1.0, 4.0))
    told = formats.info(path)
    assert told["format"] == f"OME-Zarr {'0.4' if version == 2 else '0.5'}"
    assert (told["size"], told["components"], told["times"], told["levels"]) == ([14, 12, 10], 3, 2, 2)
    assert told["chunks"] == [7, 6, 5]
    json.dumps(told)


def test_the_source_reads_one_channel_and_no_other(tmp_path, stack):
    path = write(tmp_path / "cells.zarr", stack)
    volume = call("source.volume", path=str(path), component=2, time=1, length_scale=10.0)
    assert volume.components == 1
    assert volume.buffer.resident == 0
    assert np.array_equal(volume.data, stack[1, 2])
    assert np.allclose(volume.spacing, (0.0025, 5.0, 20.0))
    assert call("source.volume", path=str(path), level=1).dims == (7, 6, 5)


def test_types_that_are_not_native(tmp_path, stack):
    for name, data in {"flags": stack[0, 0] > 2000, "big": stack[0, 0].astype(">f4")}.items():
        zarr.create_array(tmp_path / f"{name}.zarr", data=data, chunks=(4, 5, 6))
        volume = formats.read(tmp_path / f"{name}.zarr")
        assert volume.dtype.isnative
        assert volume.dtype == (np.uint8 if name == "flags" else np.float32)
        assert np.array_equal(volume.data, data)


def test_a_bare_array_a_flat_image_and_labels(tmp_path, stack):
    zarr.create_array(tmp_path / "bare.zarr", data=stack[0, 0], chunks=(4, 4, 4))
    bare = formats.read(tmp_path / "bare.zarr")
    assert np.array_equal(bare.data, stack[0, 0])
    assert bare.spacing.tolist() == [1.0, 1.0, 1.0]
    labels = formats.read_labels(tmp_path / "bare.zarr")
    assert np.array_equal(labels.data, stack[0, 0])
    flat = zarr.open_group(tmp_path / "flat.zarr", mode="w")
    flat.create_array("0", data=stack[0, 0, 0], chunks=(4, 4))
    image = {"axes": SPACE[1:], "datasets": [{"path": "0"}]}
    flat.attrs["ome"] = {"version": "0.5", "multiscales": [image]}
    volume = formats.read(tmp_path / "flat.zarr")
    assert volume.dims == (14, 12, 1)
    assert np.array_equal(volume.data[0], stack[0, 0, 0])


def test_axes_may_stand_in_any_order_and_point_anywhere(tmp_path, stack):
    pointing = {"x": "left-to-right", "z": "inferior-to-superior", "y": "anterior-to-posterior"}
    axes = [
        {"name": name, "type": "space", "unit": "mm", "orientation": {"type": "anatomical", "value": value}}
        for name, value in pointing.items()
    ]
    levels = [
        {
            "path": "0",
            "coordinateTransformations": [
                {"type": "scale", "scale": [2.0, 3.0, 4.0]},
                {"type": "translation", "translation": [10.0, 20.0, 30.0]},
            ],
        }
    ]
    data = stack[0, 0]  # (10, 12, 14) now means (x, z, y)
    volume = formats.read(write(tmp_path / "turned.zarr", data, axes=axes, levels=levels))
    assert volume.dims == (10, 14, 12)
    assert np.array_equal(volume.data, data.transpose(1, 2, 0))
    assert np.array_equal(volume.part((1, 2, 3), (4, 5, 7)).data, data.transpose(1, 2, 0)[3:7, 2:5, 1:4])
    assert np.allclose(volume.index_to_world[:3], [[-2, 0, 0, -10], [0, 4, 0, 30], [0, 0, 3, 20]])


def test_a_network_shows_a_file_in_chunks_as_it_shows_an_array(tmp_path, device):
    """A processor that knows nothing of chunks gets the whole; what was read can be let go, the picture stays."""
    data = np.random.default_rng(4).integers(0, 200, (12, 14, 16)).astype(np.int16)
    np.save(tmp_path / "field.npy", data)
    zarr.create_array(tmp_path / "field.zarr", data=data, chunks=(5, 6, 7))
    pictures = []
    for name in ("field.npy", "field.zarr"):
        volume = call("source.volume", path=str(tmp_path / name))
        smooth = call("filter.gaussian_blur", volume=volume, sigma=1.0)
        keys = [(0.0, (1.0, 0.5, 0.2), 0.0), (200.0, (1.0, 1.0, 1.0), 0.3)]
        settings = {"transfer_function": TransferFunction(keys), "camera": Camera((0, -60, 0))}
        image = call("render.raycast", device, size=(24, 20), volume=volume, **settings)
        pictures.append((smooth.data, image.color))
        volume.buffer.release()
        assert np.array_equal(volume.data, data)
    assert pictures[0][1].any()
    assert np.array_equal(pictures[0][0], pictures[1][0])
    assert np.array_equal(pictures[0][1], pictures[1][1])


def test_the_command_line_tells_of_a_folder(tmp_path, stack, capsys):
    path = write(tmp_path / "cells.zarr", stack)
    assert main(["info", str(path)]) == 0
    assert "OME-Zarr 0.5" in capsys.readouterr().out


def test_a_folder_has_a_state_that_follows_its_metadata(tmp_path, stack):
    path = write(tmp_path / "cells.zarr", stack)
    before = file_state(path)
    assert file_state(path) == before
    os.utime(path / "zarr.json", (1, 1))
    assert file_state(path) != before


BAD = {
    "axes": ({"axes": ["z", "y"]}, "axes: expected 5 axes with names"),
    "unit": (
        {"axes": [*SPACE[:2], {"name": "x", "type": "space", "unit": "micrometre"}]},
        r"unit: unknown unit of length 'micrometre' \(did you mean 'micrometer'\?\)",
    ),
    "transform": (
        {"levels": [{"path": "0", "coordinateTransformations": [{"type": "rotation"}]}]},
        "coordinateTransformations: transformations are scale and translation, got 'rotation'",
    ),
    "scale": (
        {"levels": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 2]}]}]},
        "scale: expected 5 numbers",
    ),
    "singular": (
        {"levels": [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [0, 0, 0, 0, 0]}]}]},
        "singular",
    ),
    "axes of another type": ({"axes": 5}, "axes: expected 5 axes with names, got 5"),
    "unit of another type": (
        {"axes": [*SPACE[:2], {"name": "x", "type": "space", "unit": ["micrometer"]}]},
        "unit: unknown unit of length",
    ),
    "transforms of another type": (
        {"coordinateTransformations": 5},
        "coordinateTransformations: expected a list of transformations, got 5",
    ),
    "number out of reach": (
        {"coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1, 1, 10**400]}]},
        "scale: expected 5 numbers",
    ),
    "missing": ({"levels": [{"path": "7"}]}, "datasets: there is no array '7'"),
    "outside": ({"levels": [{"path": "../other"}]}, "datasets: there is no array '../other'"),
    "datasets": ({"datasets": [3]}, "datasets: expected a list of datasets with paths"),
}


@pytest.mark.parametrize("fault", BAD)
def test_damaged_metadata_is_one_sentence(tmp_path, stack, fault):
    changes, message = BAD[fault]
    data = stack[0, 0] if fault.startswith("unit") else stack
    path = write(tmp_path / "bad.zarr", data, **changes)
    with pytest.raises(FormatError, match=f"bad.zarr: .*{message}|bad.zarr: {message}"):
        formats.read(path)


def test_what_is_no_image_is_said(tmp_path, stack):
    path = write(tmp_path / "cells.zarr", stack)
    for options, message in [
        ({"level": 2}, "level: 2 is outside 0..1"),
        ({"time": 2}, r"time: step 2 is outside 0..1"),
        ({"levle": 1}, r"this format has no option 'levle' to read \(did you mean 'level'\?\)"),
    ]:
        with pytest.raises(FormatError, match=message):
            formats.read(path, **options)
    zarr.open_group(tmp_path / "plain.zarr", mode="w").create_array("field", data=stack[0, 0])
    with pytest.raises(FormatError, match=r"multiscales: this group has no image \(no multiscales\); it holds field"):
        formats.read(tmp_path / "plain.zarr")
    (tmp_path / "empty.zarr").mkdir()
    with pytest.raises(FormatError, match=r"empty.zarr: no Zarr array or group can be opened here"):
        formats.read(tmp_path / "empty.zarr")
    (tmp_path / "study.v1").mkdir()
    with pytest.raises(FormatError, match="this is a folder; choose a file in it"):
        formats.read(tmp_path / "study.v1")
    zarr.create_array(tmp_path / "waves.zarr", data=stack[0, 0].astype(np.complex64))
    with pytest.raises(FormatError, match="data_type: complex numbers"):
        formats.read(tmp_path / "waves.zarr")


def test_a_damaged_chunk_is_an_error_of_the_file_when_it_is_read(tmp_path, stack):
    path = write(tmp_path / "cells.zarr", stack[0, 0])
    for chunk in (path / "0" / "c").rglob("*"):
        if chunk.is_file():
            chunk.write_bytes(b"nothing")
    volume = formats.read(path)
    with pytest.raises(FormatError, match=r"cells.zarr: 0: a chunk cannot be read"):
        volume.part((0, 0, 0), (2, 2, 2))


def test_a_chunk_that_no_memory_holds_is_refused(tmp_path):
    shape = (1 << 16,) * 3
    zarr.create_array(tmp_path / "huge.zarr", shape=shape, chunks=shape, dtype="u2")
    with pytest.raises(FormatError, match=r"chunks: a chunk of .* GiB does not fit into memory; write the file with"):
        formats.read(tmp_path / "huge.zarr")
    zarr.create_array(tmp_path / "large.zarr", shape=shape, chunks=(64, 64, 64), dtype="u2")
    volume = formats.read(tmp_path / "large.zarr")
    assert not volume.part((60000, 60000, 60000), (60010, 60010, 60010)).data.any()
    with pytest.raises(FormatError, match="GiB do not fit into the"):
        _ = volume.data
