"""Buffers, and what every value has in common."""

import gc
import threading
import time
import weakref

import numpy as np
import pytest

from nodegraph.data import (
    Buffer,
    Camera,
    Image,
    Key,
    Labels,
    Light,
    Mapping,
    Mesh,
    Plane,
    Table,
    TransferFunction,
    Value,
    Volume,
    as_buffer,
)
from nodegraph.errors import PortError


def test_a_host_buffer_is_a_read_only_view():
    base = np.arange(6.0).reshape(2, 3)
    buffer = Buffer(base)
    assert np.shares_memory(buffer.array, base)
    assert base.flags.writeable
    with pytest.raises(ValueError):
        buffer.array[0, 0] = 1.0
    assert (buffer.shape, buffer.dtype, buffer.nbytes, buffer.on_host) == ((2, 3), np.float64, 48, True)
    assert as_buffer(buffer) is buffer


def test_however_many_threads_read_a_device_buffer_they_get_one_array_and_later_nobody_fetches():
    calls, arrays = [], []
    start = threading.Barrier(16)

    def fetch():
        calls.append(threading.get_ident())
        time.sleep(0.02)
        return np.ones((3, 4), np.float32)

    buffer = Buffer.on_device((3, 4), "f4", fetch)
    assert not buffer.on_host
    assert buffer.nbytes == 48

    def read():
        start.wait()
        arrays.append(buffer.array)

    threads = [threading.Thread(target=read) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    fetched = len(calls)
    assert 1 <= fetched <= 16
    assert buffer.array is arrays[0]
    assert len(calls) == fetched
    assert len(arrays) == 16
    assert all(array is arrays[0] for array in arrays)
    assert not arrays[0].flags.writeable
    assert buffer.on_host


def test_the_way_to_the_device_is_forgotten_once_the_data_is_here():
    class Token:
        pass

    token = Token()
    alive = weakref.ref(token)
    buffer = Buffer.on_device((1,), "f4", lambda token=token: np.zeros(1, np.float32))
    del token
    assert alive() is not None
    assert buffer.array.shape == (1,)
    gc.collect()
    assert alive() is None


@pytest.mark.parametrize("wrong", [np.zeros((4, 3), np.float32), np.zeros((3, 4), np.float64)])
def test_a_device_that_returns_something_else_is_an_error(wrong):
    buffer = Buffer.on_device((3, 4), "f4", lambda: wrong)
    with pytest.raises(PortError, match="promised"):
        _ = buffer.array
    assert not buffer.on_host


def test_a_fetch_that_fails_may_be_tried_again():
    answers = [RuntimeError("lost"), np.zeros(2, np.float32)]

    def fetch():
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    buffer = Buffer.on_device((2,), "f4", fetch)
    with pytest.raises(RuntimeError, match="lost"):
        _ = buffer.array
    assert buffer.array.tolist() == [0.0, 0.0]


VALUES = {
    "volume": lambda: Volume(
        np.arange(24, dtype=np.int16).reshape(2, 3, 4), np.diag([1.0, 2.0, 3.0, 1.0]), Mapping(2.0, -5.0, "HU")
    ),
    "vectors": lambda: Volume(np.ones((2, 3, 4, 3), np.float32)),
    "labels": lambda: Labels(np.arange(8, dtype=np.uint8).reshape(2, 2, 2), names={1: "liver", 7: "spleen"}),
    "mesh": lambda: Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    "table": lambda: Table({"name": ["a", "b"], "volume": [1.0, 2.5]}, {"volume": "mm^3"}),
    "image": lambda: Image(
        np.full((2, 3, 4), 0.25, np.float32), np.full((2, 3), np.inf, np.float32), np.full((2, 3), 2**31, np.uint32)
    ),
    "color": lambda: Image(np.zeros((2, 2, 1), np.float64)),
    "camera": lambda: Camera((1, 2, 3), (4, 5, 7), (0, 1, 0), "orthographic", 20.0, 50.0),
    "light": lambda: Light("point", "world", (1, 2, 3), (1, 0.5, 0.25), 3.0),
    "plane": lambda: Plane((1, 2, 3), (0, 3, 4)),
    "transfer function": lambda: TransferFunction([(0, (0, 0, 0), 0), (1, (1, 0.5, 0), 0.75)], 2.0),
}


@pytest.mark.parametrize("name", VALUES)
def test_values_refuse_to_be_changed(name):
    value = VALUES[name]()
    assert isinstance(value, Value)
    attributes = [a for a in vars(value) if not a.startswith("_")] or ["data"]
    for attribute in attributes:
        with pytest.raises(AttributeError, match="immutable"):
            setattr(value, attribute, None)
        with pytest.raises(AttributeError, match="immutable"):
            delattr(value, attribute)
    for buffer in value.buffers:
        assert not buffer.array.flags.writeable
    assert value.nbytes == sum(buffer.array.nbytes for buffer in value.buffers)
    assert value.summary()
    assert type(value).__name__ in repr(value)


@pytest.mark.parametrize("name", VALUES)
def test_provenance_is_set_once(name):
    value = VALUES[name]()
    assert value.provenance is None
    value.provenance = b"key"
    value.provenance = b"key"
    with pytest.raises(AttributeError):
        value.provenance = b"another"
    assert value.provenance == b"key"


@pytest.mark.parametrize("name", VALUES)
def test_parts_make_an_equal_value(name):
    import json

    value = VALUES[name]()
    meta, arrays = value.to_parts()
    again = type(value).from_parts(json.loads(json.dumps(meta)), {key: array.copy() for key, array in arrays.items()})
    meta_again, arrays_again = again.to_parts()
    assert meta_again == meta
    assert arrays_again.keys() == arrays.keys()
    for key, array in arrays.items():
        assert arrays_again[key].dtype == array.dtype
        assert np.array_equal(arrays_again[key], array)


def test_json_values_compare_and_hash_by_content():
    for name in ("camera", "light", "plane", "transfer function"):
        a, b = VALUES[name](), VALUES[name]()
        assert a == b
        assert hash(a) == hash(b)
        assert a != object()
        assert type(a).from_json(a.to_json()) == a
    assert VALUES["camera"]() != VALUES["camera"]().with_(height=51.0)
    assert Key(0.0, (0.0, 0.0, 0.0), 0.0) == TransferFunction([(0, (0, 0, 0), 0)]).keys[0]


def test_side_tables_cannot_be_written():
    labels, table = VALUES["labels"](), VALUES["table"]()
    with pytest.raises(TypeError):
        labels.names[1] = "kidney"
    with pytest.raises(TypeError):
        table.units["volume"] = "l"
    with pytest.raises(ValueError):
        table["volume"][0] = 3.0
    with pytest.raises(ValueError):
        VALUES["camera"]().basis[0][0] = 3.0
