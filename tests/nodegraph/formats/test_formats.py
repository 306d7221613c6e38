"""Finding a format, writing whole files, and files that are damaged in every way."""

import errno
import gzip
import os
import stat
import tracemalloc
import types

import numpy as np
import pytest

from nodegraph import formats, plugins
from nodegraph.data import Image, Volume
from nodegraph.data.space import affine
from nodegraph.errors import FormatError
from nodegraph.formats import oiio
from tests.nodegraph.formats.expected import FILES

VOLUME = Volume(np.arange(60, dtype=np.int16).reshape(3, 4, 5), affine((1, 2, 3), (4, 5, 6)))
IMAGE = Image(np.full((3, 4, 4), 0.5, np.float32), np.ones((3, 4), np.float32), np.ones((3, 4), np.uint32))
VOLUME_NAMES = ("a.nii", "a.nii.gz", "a.nrrd", "a.npy", "a.npz")
IMAGE_NAMES = ("a.png", "a.exr", "b.npz")
NAMES = (*VOLUME_NAMES, *IMAGE_NAMES)


def value_of(name):
    return IMAGE if name in IMAGE_NAMES else VOLUME


# -- lookup ---------------------------------------------------------------------------------------------------------


def test_a_format_is_found_by_the_longest_suffix():
    assert formats.find("x.y.nii.gz").__name__ == "nodegraph.formats.nifti"
    assert formats.find("X.NRRD").__name__ == "nodegraph.formats.nrrd"
    assert set(formats.suffixes(write=True)) == set(formats.suffixes()) - {".nhdr", ".zarr"}


@pytest.mark.parametrize(
    ("name", "message"),
    [("a.nii.zip", "no format has the suffix '.zip'"), ("a.ni", r"did you mean '\.nii'"), ("a", "no suffix")],
)
def test_an_unknown_suffix_is_answered_with_the_known_ones(tmp_path, name, message):
    (tmp_path / name).touch()
    with pytest.raises(FormatError, match=message):
        formats.read(tmp_path / name)
    with pytest.raises(FormatError, match=message):
        formats.write(VOLUME, tmp_path / name)


def test_a_file_that_is_not_there(tmp_path):
    (tmp_path / "chest.nii").touch()
    with pytest.raises(FormatError, match=r"there is no such file \(did you mean 'chest\.nii'\?\)"):
        formats.read(tmp_path / "chets.nii")
    with pytest.raises(FormatError, match="there is no such file"):
        formats.info(tmp_path / "nowhere" / "a.nii")
    with pytest.raises(FormatError, match="folder"):
        formats.read(tmp_path)


def test_an_option_that_the_format_lacks(tmp_path):
    with pytest.raises(FormatError, match=r"no option 'bit' to write \(did you mean 'bits'\?\)"):
        formats.write(IMAGE, tmp_path / "a.png", bit=8)
    with pytest.raises(FormatError, match="no option 'time' to read"):
        formats.read(FILES / "itk_rgba.png", time=1)


@pytest.mark.parametrize("name", NAMES)
def test_info_agrees_with_what_is_read(tmp_path, name):
    value = value_of(name)
    formats.write(value, tmp_path / name)
    told = formats.info(tmp_path / name)
    assert told["kind"] == value.kind
    assert told["bytes_on_disk"] == (tmp_path / name).stat().st_size
    assert told["size"] == list(value.size if value is IMAGE else value.dims)
    if name in VOLUME_NAMES[:3]:
        assert np.allclose(told["spacing"], [1, 2, 3])


def test_info_reads_no_data(tmp_path):
    formats.write(Volume(np.zeros((64, 256, 256), np.int16)), tmp_path / "a.nii.gz")
    tracemalloc.start()
    formats.info(tmp_path / "a.nii.gz")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e6


@pytest.fixture
def plugged(monkeypatch):
    """A format of one text line, as a package would bring it, beside one that cannot be imported."""

    def read(path, *, factor=1.0):
        return Volume(np.full((1, 1, 1), float(path.read_text()) * factor, np.float32))

    def write(value, path):
        with formats.replacing(path) as part:
            part.write_text(str(value.data[0, 0, 0]))

    one = types.SimpleNamespace(suffixes=(".one", ".nii"), read=read, write=write)
    offered = (
        plugins.Plugin("one", one, "", "package"),
        plugins.Plugin("bad", None, "needs the package 'vtk': pip install vtk", "other"),
    )
    monkeypatch.setattr(plugins, "discover", lambda group: offered if group == "nodegraph.formats" else ())
    return one


def test_a_package_may_bring_a_format(tmp_path, plugged):
    formats.write(Volume(np.full((1, 1, 1), 7.0)), tmp_path / "a.one")
    assert formats.read(tmp_path / "a.one", factor=2.0).data.item() == 14.0
    assert formats.read_labels(tmp_path / "a.one").data.item() == 7
    assert "summary" in formats.info(tmp_path / "a.one")
    assert ".one" in formats.suffixes(write=True)
    assert formats.find("a.nii").__name__ == "nodegraph.formats.nifti", "a built-in format is not hidden"
    with pytest.raises(FormatError, match="the plug-in bad is unavailable: needs the package 'vtk'"):
        formats.find("a.vti")
    plugged.read = lambda path: "text"
    with pytest.raises(FormatError, match="no value"):
        formats.read(tmp_path / "a.one")


def test_what_holds_no_labels(tmp_path):
    formats.write(IMAGE, tmp_path / "a.png")
    with pytest.raises(FormatError, match="not labels"):
        formats.read_labels(tmp_path / "a.png")
    formats.write(VOLUME.with_data(VOLUME.data - 1), tmp_path / "a.nrrd")
    with pytest.raises(FormatError, match=r"ids in 0\.\.4294967295, got -1"):
        formats.read_labels(tmp_path / "a.nrrd")


# -- whole files ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_a_file_that_is_replaced_while_it_is_mapped_stays_what_it_was(tmp_path, name):
    formats.write(value_of(name), tmp_path / name)
    before = formats.read(tmp_path / name)
    kept = before.data.copy()
    other = IMAGE.with_color(IMAGE.color * 0) if name in IMAGE_NAMES else VOLUME.with_data(VOLUME.data * 0)
    formats.write(other, tmp_path / name)
    assert np.array_equal(before.data, kept)
    assert not formats.read(tmp_path / name).data.any()
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("name", NAMES)
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, name, error):
    (tmp_path / name).write_text("old")

    def fail(*_arguments, **_options):
        raise error

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(FormatError if isinstance(error, OSError) else KeyboardInterrupt, match=r"disk is full|^$"):
        formats.write(value_of(name), tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "old"


@pytest.mark.parametrize("name", NAMES)
def test_a_full_disk(monkeypatch, tmp_path, name):
    """The system's own full device, reached through the temporary name."""
    real_open = os.open
    parts = []

    def open_full(path, flags, mode=0o777, **rest):
        if str(path).endswith(".part"):
            os.symlink("/dev/full", path)
            parts.append(path)
            return real_open("/dev/null", os.O_WRONLY)
        return real_open(path, flags, mode, **rest)

    monkeypatch.setattr(os, "open", open_full)
    with pytest.raises(FormatError, match=r"disk|space|written"):
        formats.write(value_of(name), tmp_path / name)
    assert parts
    assert not list(tmp_path.iterdir())


def test_permissions_and_links_are_kept(tmp_path):
    before = os.umask(0o027)
    try:
        formats.write(VOLUME, tmp_path / "a.nii")
        assert stat.S_IMODE((tmp_path / "a.nii").stat().st_mode) == 0o640
    finally:
        os.umask(before)
    (tmp_path / "a.nii").chmod(0o604)
    (tmp_path / "link.nii").symlink_to("a.nii")
    formats.write(VOLUME, tmp_path / "link.nii")
    assert (tmp_path / "link.nii").is_symlink()
    assert stat.S_IMODE((tmp_path / "a.nii").stat().st_mode) == 0o604


def test_where_nothing_can_be_written(tmp_path):
    with pytest.raises(FormatError, match="does not exist; create it first"):
        formats.write(VOLUME, tmp_path / "nowhere" / "a.nii")
    (tmp_path / "a.nii").mkdir()
    with pytest.raises(FormatError, match="this is a folder"):
        formats.write(VOLUME, tmp_path / "a.nii")


def test_a_library_that_cannot_open_the_file_says_so(tmp_path):
    part = oiio.Part(np.zeros((1, 1, 1), np.uint8), (("Y", "uint8"),), {})
    with pytest.raises(FormatError, match=r"a\.png: cannot be written"):
        oiio.write(tmp_path / "nowhere" / "x", tmp_path / "a.png", "png", [part])


# -- damage ---------------------------------------------------------------------------------------------------------


def try_to_read(path):
    """A damaged file gives a value or one FormatError that names the file, in a single line; and takes no memory."""
    message = ""
    tracemalloc.start()
    try:
        value = formats.read(path)
    except FormatError as error:
        message, value = str(error), None
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert isinstance(value, (Volume, Image)) or message.startswith(str(path))
    assert "\n" not in message
    assert peak < 80e6


@pytest.mark.parametrize("name", NAMES)
def test_a_file_that_is_cut_short_is_refused(tmp_path, name):
    formats.write(value_of(name), tmp_path / name)
    blob = (tmp_path / name).read_bytes()
    for length in sorted({0, 1, 4, 8, 40, 100, 200, 347, 360, len(blob) // 2, len(blob) - 30}):
        if 0 <= length < len(blob):
            (tmp_path / name).write_bytes(blob[:length])
            with pytest.raises(FormatError, match=name.replace(".", r"\.")):
                formats.read(tmp_path / name)


@pytest.mark.parametrize("name", NAMES)
def test_garbage_is_refused(tmp_path, rng, name):
    for size in (10, 1000, 100_000):
        (tmp_path / name).write_bytes(rng.bytes(size))
        with pytest.raises(FormatError):
            formats.read(tmp_path / name)
        with pytest.raises(FormatError):
            formats.info(tmp_path / name)


@pytest.mark.parametrize("name", NAMES)
def test_flipped_bits_never_end_in_a_traceback(tmp_path, rng, name):
    formats.write(value_of(name), tmp_path / name)
    blob = (tmp_path / name).read_bytes()
    for _ in range(60):
        broken = bytearray(blob)
        for at in rng.integers(0, min(len(blob), 600), rng.integers(1, 5)):
            broken[at] = rng.integers(0, 256)
        (tmp_path / name).write_bytes(broken)
        try_to_read(tmp_path / name)


FIELDS = {
    "zero axis": (42, np.int16(0), r"dim\[1\]: an axis has 0"),
    "negative axis": (44, np.int16(-3), r"dim\[2\]"),
    "many axes": (40, np.int16(99), r"dim\[0\]: 99 axes"),
    "huge axes": (42, np.array([30000, 30000, 30000], np.int16), "promises"),
    "complex": (70, np.int16(32), "datatype: the type complex64"),
    "unknown type": (70, np.int16(4711), "datatype"),
    "offset in the header": (108, np.float32(3), "vox_offset"),
    "offset nan": (108, np.float32(np.nan), "vox_offset"),
    "offset behind the end": (108, np.float32(1e9), "promises"),
    "nan in the matrix": (280, np.float32(np.nan), "srow"),
    "flat matrix": (280, np.zeros(4, np.float32), "srow"),
    "unit": (123, np.uint8(5), "xyzt_units"),
    "offset of values": (112, np.array([1.0, np.inf], np.float32), "scl_inter"),
    "two files": (344, np.frombuffer(b"ni1\0", np.uint8), "magic: the data lies in another file"),
    "magic": (344, np.frombuffer(b"abc\0", np.uint8), "magic"),
}


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("case", FIELDS)
def test_a_wrong_nifti_header_names_its_field(tmp_path, case, suffix):
    offset, value, message = FIELDS[case]
    formats.write(VOLUME, tmp_path / "a.nii")
    blob = bytearray((tmp_path / "a.nii").read_bytes())
    blob[offset : offset + value.nbytes] = value.tobytes()
    path = tmp_path / f"b{suffix}"
    path.write_bytes(gzip.compress(blob) if suffix == ".nii.gz" else bytes(blob))
    if case == "offset behind the end" and suffix == ".nii.gz":
        message = "cannot hold|ends"
    with pytest.raises(FormatError, match=message):
        formats.read(path)


def test_a_bomb_is_not_unpacked(tmp_path):
    """A gigabyte of zeros in a megabyte: read if the header promises less, refused if it promises more than fits."""
    formats.write(VOLUME, tmp_path / "a.nii")
    head = (tmp_path / "a.nii").read_bytes()
    path = tmp_path / "b.nii.gz"
    with gzip.open(path, "wb", 9) as stream:
        stream.write(head)
        for _ in range(64):
            stream.write(bytes(1 << 20))
    tracemalloc.start()
    assert np.array_equal(formats.read(path).data, VOLUME.data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5e6


def test_a_damaged_checksum_is_noticed(tmp_path):
    formats.write(VOLUME, tmp_path / "a.nii.gz")
    blob = bytearray((tmp_path / "a.nii.gz").read_bytes())
    blob[-6] ^= 1
    (tmp_path / "a.nii.gz").write_bytes(blob)
    with pytest.raises(FormatError, match="damaged"):
        formats.read(tmp_path / "a.nii.gz")


def test_a_pipe_is_refused_and_a_link_to_nowhere_is_not_its_own_near_miss(tmp_path):
    os.mkfifo(tmp_path / "pipe.nii")
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "loop.nii").symlink_to("loop.nii")
    for act in (formats.read, formats.info):
        with pytest.raises(FormatError, match=r"pipe\.nii: this is a pipe or a device, and no file"):
            act(tmp_path / "pipe.nii")
        with pytest.raises(FormatError, match="there is no such file; check the path"):
            act(tmp_path / "links" / "loop.nii")
