"""PNG and EXR: colour, depth, ids and the workspace that made them."""

import json
import os
import struct
import zlib

import numpy as np
import pytest

from nodegraph import formats
from nodegraph.data import Image, Volume
from nodegraph.errors import FormatError
from nodegraph.formats import exr, png, srgb
from tests.nodegraph.formats.expected import FILES

TEXT = '{"nodegraph": 1, "note": "größer 体 😀"}'


@pytest.fixture
def picture(rng):
    alpha = rng.random((7, 9, 1)).astype(np.float32)
    alpha[0, 0], alpha[1, 1] = 0.0, 1.0
    depth = rng.uniform(1, 1e6, (7, 9)).astype(np.float32)
    depth[2, 3] = np.inf
    ids = rng.integers(2**24, 2**32, (7, 9), np.uint32)
    return Image(np.concatenate([rng.random((7, 9, 3)).astype(np.float32) * alpha, alpha], axis=2), depth, ids)


def test_the_curve_of_srgb():
    assert srgb.encode([0.0, 0.0031308, 0.5, 1.0]) == pytest.approx([0.0, 0.04044994, 0.7353569, 1.0], abs=1e-6)
    x = np.linspace(0, 1, 1001)
    assert np.abs(srgb.decode(srgb.encode(x)) - x).max() < 1e-7
    assert srgb.encode([-1.0, 2.0, np.nan, np.inf]) == pytest.approx([0.0, 1.0, 0.0, 1.0], abs=1e-15)
    assert srgb.encode(np.float32([0.5])).dtype == np.float32


@pytest.mark.parametrize("bits", [8, 16])
def test_png_is_as_exact_as_its_bits(tmp_path, picture, bits):
    formats.write(picture, tmp_path / "a.png", bits=bits)
    again = formats.read(tmp_path / "a.png")
    # Half a step of the stored number, times the steepest slope of the curve (2.28), and alpha's own half step.
    assert np.abs(again.color - picture.color).max() < (2.28 + 1.0) * 0.5 / (2**bits - 1) + 1e-6
    assert again.depth is None
    assert formats.info(tmp_path / "a.png")["bits"] == bits


@pytest.mark.parametrize("bits", [8, 16])
def test_stored_numbers_survive_reading_and_writing(tmp_path, bits):
    """What was written once is written again the same: no drift, and no premultiplication by the library."""
    levels = np.linspace(0, 1, 64, dtype=np.float32)
    straight = np.stack(np.meshgrid(levels, levels), -1)
    color = np.concatenate([np.repeat(srgb.decode(straight[..., :1]), 3, axis=2), straight[..., 1:]], axis=2)
    formats.write(Image(color * np.where(np.arange(4) < 3, color[..., 3:], 1.0)), tmp_path / "a.png", bits=bits)
    formats.write(formats.read(tmp_path / "a.png"), tmp_path / "b.png", bits=bits)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_row_0_is_on_top_and_nothing_is_flipped(tmp_path):
    color = np.zeros((2, 3, 4), np.float32)
    color[..., 3] = 1.0
    color[0, 2, 0] = 1.0
    for name in ("a.png", "a.exr"):
        formats.write(Image(color), tmp_path / name)
        assert np.array_equal(formats.read(tmp_path / name).color, color)
    raw = zlib.decompress(b"".join(d for kind, d in chunks((tmp_path / "a.png").read_bytes()) if kind == b"IDAT"))
    assert len(raw) == 2 * (1 + 3 * 4), "8 bits, RGBA"


def chunks(blob):
    at = 8
    while at < len(blob):
        length, kind = struct.unpack(">I4s", blob[at : at + 8])
        yield kind, blob[at + 8 : at + 8 + length]
        at += 12 + length


def test_over_a_background_the_png_is_opaque(tmp_path, picture):
    formats.write(picture, tmp_path / "a.png", bits=16, background=(0.0, 0.5, 1.0))
    header = dict(chunks((tmp_path / "a.png").read_bytes()))[b"IHDR"]
    assert header[9] == 2, "RGB"
    again = formats.read(tmp_path / "a.png").color
    assert (again[..., 3] == 1.0).all()
    assert np.abs(again[..., :3] - picture.over((0.0, 0.5, 1.0))).max() < 3e-5


def test_the_workspace_travels_in_the_picture(tmp_path, picture):
    large = json.dumps({"text": "x" * 300_000})
    for text in (TEXT, large):
        formats.write(picture, tmp_path / "a.png", workspace=text)
        assert json.loads(png.read_workspace(tmp_path / "a.png")) == json.loads(text)
        formats.write(picture, tmp_path / "a.exr", workspace=text)
        assert json.loads(exr.read_workspace(tmp_path / "a.exr")) == json.loads(text)
    assert formats.info(tmp_path / "a.png")["workspace"] is True
    formats.write(picture, tmp_path / "b.png")
    formats.write(picture, tmp_path / "b.exr")
    assert png.read_workspace(tmp_path / "b.png") is None
    assert exr.read_workspace(tmp_path / "b.exr") is None
    assert png.read_workspace(FILES / "itk_rgba.png") is None


def test_encode_gives_the_bytes_of_the_file(tmp_path, picture):
    formats.write(picture, tmp_path / "a.png", workspace=TEXT)
    assert png.encode(picture, workspace=TEXT) == (tmp_path / "a.png").read_bytes()


def test_one_channel_is_grey(tmp_path):
    formats.write(Image(np.full((2, 3), 0.25, np.float32)), tmp_path / "a.png", bits=16)
    assert formats.read(tmp_path / "a.png").color[0, 0] == pytest.approx([0.25, 0.25, 0.25, 1.0], abs=1e-5)


def test_what_is_not_between_0_and_1_is_clipped(tmp_path):
    color = np.array([[[2.0, -1.0, np.nan, 1.0], [np.inf, 0.0, 0.0, 2.0], [1.0, 1.0, 1.0, np.nan]]], np.float32)
    formats.write(Image(color), tmp_path / "a.png")
    again = formats.read(tmp_path / "a.png").color
    assert again[0, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert again[0, 1].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert again[0, 2].tolist() == [0.0] * 4


def test_pngs_of_other_programs():
    color = np.zeros((4, 6, 4), np.float32)
    color[..., 0] = srgb.decode(np.arange(6) / 5)
    color[..., 1] = srgb.decode(np.arange(4)[:, None] / 3)
    color[..., 3] = (255 - 40 * np.arange(6)) / 255
    color[..., :3] *= color[..., 3:]
    assert np.abs(formats.read(FILES / "itk_rgba.png").color - color).max() < 1e-6
    grey = formats.read(FILES / "itk_grey16.png").color
    assert np.abs(grey[..., 0] - srgb.decode(np.arange(24).reshape(4, 6) * 2849 / 65535)).max() < 1e-6
    palette = formats.read(FILES / "magick_palette.png").color
    assert palette[0, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert palette[2, 4].tolist() == [0.0, 0.0, 1.0, 1.0]
    half = formats.read(FILES / "magick_grey_alpha.png").color[1, 1]
    assert half[3] == pytest.approx(0.25, abs=0.003)
    assert half[0] == pytest.approx(0.25 * 0.2140, abs=0.002)


def test_exr_keeps_everything(tmp_path, picture):
    formats.write(picture, tmp_path / "a.exr")
    again = formats.read(tmp_path / "a.exr")
    for name in ("color", "depth", "ids"):
        assert getattr(again, name).dtype == getattr(picture, name).dtype
        assert np.array_equal(getattr(again, name), getattr(picture, name))
    told = formats.info(tmp_path / "a.exr")
    assert told["channels"] == ["R", "G", "B", "A", "Z"]
    assert (told["type"], told["ids"]) == ("float", True)


def test_half_is_for_colour_only(tmp_path, picture):
    formats.write(picture, tmp_path / "a.exr", half=True)
    again = formats.read(tmp_path / "a.exr")
    assert np.array_equal(again.color, picture.color.astype(np.float16).astype(np.float32))
    assert np.array_equal(again.depth, picture.depth)
    assert formats.info(tmp_path / "a.exr")["type"] == "half"


def test_exr_of_one_two_and_double_channels(tmp_path, rng):
    for channels in (1, 2, 4):
        image = Image(rng.normal(size=(3, 4, channels)) * 100)
        formats.write(image, tmp_path / "a.exr")
        assert np.array_equal(formats.read(tmp_path / "a.exr").color, image.color.astype(np.float32))


def test_refusals(tmp_path, picture):
    with pytest.raises(FormatError, match="two channels"):
        formats.write(Image(np.zeros((2, 2, 2), np.float32)), tmp_path / "a.png")
    with pytest.raises(FormatError, match="bits: expected 8 or 16"):
        formats.write(picture, tmp_path / "a.png", bits=12)
    for name in ("a.png", "a.exr"):
        with pytest.raises(FormatError, match="holds pictures"):
            formats.write(Volume(np.zeros((2, 2, 2), np.uint8)), tmp_path / name)
    with pytest.raises(FormatError, match="holds volumes"):
        formats.write(picture, tmp_path / "a.nii")
    assert not list(tmp_path.iterdir())


def test_a_png_that_promises_too_much_is_refused_before_memory_is_taken(tmp_path, picture):
    blob = bytearray(png.encode(picture))
    blob[16:24] = struct.pack(">II", 100_000, 100_000)
    blob[29:33] = struct.pack(">I", zlib.crc32(bytes(blob[12:29])))
    (tmp_path / "a.png").write_bytes(blob)
    with pytest.raises(FormatError, match="IHDR: the header promises"):
        formats.read(tmp_path / "a.png")


def test_an_exr_that_promises_too_much_is_refused_before_memory_is_taken(tmp_path, picture):
    formats.write(Image(picture.color), tmp_path / "a.exr")
    blob = bytearray((tmp_path / "a.exr").read_bytes())
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = blob.index(name) + len(name) + 4
        blob[at : at + 16] = struct.pack("<iiii", 0, 0, 99_999, 99_999)
    (tmp_path / "a.exr").write_bytes(blob)
    with pytest.raises(FormatError):
        formats.read(tmp_path / "a.exr")


def test_a_name_that_is_no_utf8_is_one_sentence(tmp_path):
    folder = tmp_path / os.fsdecode(b"\xff")
    folder.mkdir()
    with pytest.raises(FormatError, match="this name is no UTF-8 text; rename the file or its folder"):
        formats.write(Image(np.zeros((2, 2, 4), np.float32)), folder / "a.png")
    assert list(folder.iterdir()) == []
