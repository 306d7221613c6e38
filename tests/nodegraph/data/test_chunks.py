"""Arrays in chunks: any block is what the array holds there, read once, kept within bounds, let go when asked."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.cache import Result, ResultCache
from nodegraph.data import Buffer, Labels, Volume, chunks
from nodegraph.data.bricks import brick_ranges
from nodegraph.data.chunks import ChunkedArray
from nodegraph.errors import FormatError, PortError


class Recorder:
    """An array that is read in chunks, and a record of what was read."""

    def __init__(self, array, sizes, **options):
        self.base, self.boxes = array, []
        self.array = ChunkedArray(array.shape, array.dtype, sizes, self.read, place="scan.zarr", **options)

    def read(self, box):
        self.boxes.append(box)
        return self.base[box]

    @property
    def numbers(self):
        return sum(int(np.prod([s.stop - s.start for s in box])) for box in self.boxes)


def numbers(*shape, dtype="i2"):
    return np.arange(np.prod(shape)).reshape(shape).astype(dtype)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_blocks_in_any_order_are_those_of_the_array(data):
    shape = data.draw(st.tuples(*[st.integers(1, 9)] * 3))
    sizes = data.draw(st.tuples(*[st.integers(1, 10)] * 3))
    recorder = Recorder(numbers(*shape), sizes, kept_bytes=data.draw(st.sampled_from((0, 40, 200, 10**6))))
    for _ in range(4):
        low = [data.draw(st.integers(0, n - 1)) for n in shape]
        high = [data.draw(st.integers(a + 1, n)) for a, n in zip(low, shape, strict=True)]
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        assert np.array_equal(recorder.array.block(low, high), recorder.base[box])
        assert recorder.array.resident <= recorder.array.kept_bytes


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_much_is_asked_for_in_pieces_at_borders_of_chunks(data):
    """A reader holds all chunks of a request at once, so none is larger than it must be, and no chunk is read twice."""
    shape = data.draw(st.tuples(*[st.integers(1, 12)] * 3))
    sizes = tuple(min(c, n) for c, n in zip(data.draw(st.tuples(*[st.integers(1, 12)] * 3)), shape, strict=True))
    recorder = Recorder(numbers(*shape), sizes)
    low = [data.draw(st.integers(0, n - 1)) for n in shape]
    high = [data.draw(st.integers(a + 1, n)) for a, n in zip(low, shape, strict=True)]
    most = data.draw(st.sampled_from((2, 40, 300)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunks, "PIECE_BYTES", most)
        found = recorder.array.block(low, high, keep=False)
        whole = recorder.array.whole()
    assert np.array_equal(found, recorder.base[tuple(map(slice, low, high))])
    assert np.array_equal(whole, recorder.base)
    assert recorder.numbers == found.size + whole.size
    for box in recorder.boxes:
        one_chunk = all(s.start // c == (s.stop - 1) // c for s, c in zip(box, sizes, strict=True))
        assert one_chunk or np.prod([s.stop - s.start for s in box]) * 2 <= most


def test_memory_goes_back_to_the_system_now_and_then(monkeypatch):
    given = []
    monkeypatch.setattr(chunks, "TRIM_BYTES", 3000)
    monkeypatch.setattr(chunks, "trim", lambda: given.append(recorder.numbers * 2))
    recorder = Recorder(numbers(16, 16, 16), (4, 16, 16))
    for first in range(0, 16, 4):
        recorder.array.block((first, 0, 0), (first + 4, 16, 16))
        recorder.array.block((first, 0, 0), (first + 4, 16, 16))  # kept
    assert given == [4096, 8192]
    monkeypatch.undo()
    chunks.trim()


def test_what_overlaps_is_read_once():
    """Blocks of 8 cells with a shared plane: 9 voxels, and yet each chunk is read one time."""
    recorder = Recorder(numbers(33, 33, 33), (8, 8, 8))
    for z, y, x in np.ndindex(4, 4, 4):
        recorder.array.block((8 * z, 8 * y, 8 * x), (8 * z + 9, 8 * y + 9, 8 * x + 9))
    assert recorder.numbers == 33**3
    assert recorder.array.resident == 2 * 33**3
    recorder.array.release()
    assert recorder.array.resident == 0


def test_a_buffer_in_chunks_reads_what_is_asked_for_and_all_of_it_once():
    recorder = Recorder(numbers(16, 16, 16, 2), (4, 4, 4, 1))
    buffer = Buffer.in_chunks(recorder.array)
    assert (buffer.shape, buffer.dtype, buffer.nbytes, buffer.on_host) == ((16, 16, 16, 2), np.int16, 16384, True)
    assert buffer.chunks == (4, 4, 4, 1)
    assert not recorder.boxes
    part = buffer.part((4, 4, 4), (8, 8, 8))
    assert recorder.numbers == 2 * 4**3
    with pytest.raises(ValueError):
        part[0] = 0
    second = buffer.component(1)
    assert recorder.numbers == 2 * 4**3
    assert np.array_equal(second.part((0, 0, 0), (4, 4, 4)), recorder.base[:4, :4, :4, 1])
    before = len(recorder.boxes)
    start, arrays = threading.Barrier(6), []

    def whole():
        start.wait()
        arrays.append(buffer.array)

    threads = [threading.Thread(target=whole) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(recorder.boxes) == before + 1
    assert all(array is arrays[0] for array in arrays)
    assert np.array_equal(arrays[0], recorder.base)
    assert buffer.resident >= buffer.nbytes
    buffer.release()
    assert buffer.resident == 0
    assert np.array_equal(arrays[0], recorder.base), "what was handed out stays"
    assert np.array_equal(buffer.array, recorder.base), "and it can be read again"


def test_an_array_that_does_not_fit_is_refused_before_a_byte_is_read(monkeypatch):
    recorder = Recorder(np.zeros((64, 64, 64), np.float32), (16, 16, 16))
    monkeypatch.setattr(chunks, "free_bytes", lambda: 1 << 20)
    volume = Volume(Buffer.in_chunks(recorder.array))
    with pytest.raises(FormatError) as caught:
        _ = volume.data
    assert str(caught.value) == (
        "scan.zarr: 0.000977 GiB do not fit into the 0.000977 GiB of memory that are free; choose a coarser level, or "
        "a processor that reads block by block"
    )
    assert not recorder.boxes
    assert volume.part((0, 0, 0), (4, 5, 6)).dims == (4, 5, 6)


def test_the_free_memory_is_known_here():
    assert 1 << 20 < chunks.free_bytes() < 1 << 50


@pytest.mark.parametrize("lazy", [False, True])
def test_a_part_lies_where_it_lay(lazy):
    data = numbers(10, 9, 8)
    matrix = np.array([[0, 2.0, 0, 5], [1.0, 0, 0.5, 6], [0, 0, 3.0, 7], [0, 0, 0, 1]])
    buffer = Buffer.in_chunks(Recorder(data, (4, 4, 4)).array) if lazy else Buffer(data)
    volume = Volume(buffer, matrix, (2.0, -1.0, "HU"))
    part = volume.part((1, 2, 3), (8, 6, 4))
    assert np.array_equal(part.data, data[3:4, 2:6, 1:8])
    assert part.mapping == volume.mapping
    assert np.allclose(part.index_to_world @ [0, 0, 0, 1], matrix @ [1, 2, 3, 1])
    assert lazy or np.shares_memory(part.data, data)
    assert Labels(data, names={3: "bone"}).part((0, 0, 0), (1, 1, 1)).names == {3: "bone"}
    for low, high in [((-1, 0, 0), (2, 2, 2)), ((0, 0, 0), (9, 1, 1)), ((3, 0, 0), (3, 1, 1))]:
        with pytest.raises(PortError, match=r"Volume.part: voxels .* are no block of a grid of \(8, 9, 10\)"):
            volume.part(low, high)


@pytest.mark.parametrize("depth", [3, 8, 20])
def test_ranges_stream_whatever_the_chunks(depth):
    """One pass in layers of chunks: each voxel is read once, and never all of them together."""
    data = np.random.default_rng(1).integers(-9, 9, (45, 20, 26)).astype(np.float32)
    data[3, 4, 5] = np.nan
    recorder = Recorder(data, (depth, 8, 8), kept_bytes=0)
    volume = Volume(Buffer.in_chunks(recorder.array), mapping=(2.0, 1.0, ""))
    assert np.array_equal(brick_ranges(volume), brick_ranges(Volume(data, mapping=(2.0, 1.0, ""))))
    assert volume.range == Volume(data, mapping=(2.0, 1.0, "")).range
    assert volume.buffer.resident == 0


def test_the_cache_counts_what_is_resident_and_lets_go_of_that_first(tmp_path):
    recorder = Recorder(np.zeros((32, 32, 32), np.uint8), (8, 8, 8))
    volume = Volume(Buffer.in_chunks(recorder.array))
    cache = ResultCache(40_000)
    other = np.zeros(10_000, np.uint8)
    assert cache.put(b"file", Result({"volume": volume}))
    assert cache.put(b"other", Result({"array": other}))
    assert cache.nbytes == cache.host_bytes() == 10_000
    volume.part((0, 0, 0), (8, 8, 8))
    assert cache.nbytes == 10_512
    assert volume.data.nbytes == 32_768
    assert cache.nbytes > cache.limit
    cache.trim()
    assert cache.nbytes == 10_000
    assert b"file" in cache
    assert b"other" in cache
    np.save(tmp_path / "large.npy", np.zeros(100_000, np.uint8))
    assert cache.put(b"mapped", Result({"array": np.load(tmp_path / "large.npy", mmap_mode="r")}))
    assert cache.nbytes == 10_000
