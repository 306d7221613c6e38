"""nodegraph info: where a volume lies."""

from __future__ import annotations

import json

import numpy as np

from nodegraph import formats
from nodegraph.data import Volume


def test_where_a_turned_volume_lies(cli, tmp_path) -> None:
    turned = np.array([[0.0, -2.0, 0.0, 10.0], [0.5, 0.0, 0.0, 20.0], [0.0, 0.0, 3.0, 30.0], [0.0, 0.0, 0.0, 1.0]])
    volume = Volume(np.zeros((2, 3, 4), np.uint8), turned)
    for name in ("a.nii", "a.nrrd", "a.npz"):
        formats.write(volume, tmp_path / name)
        told = json.loads(cli("info", tmp_path / name, "--json").out)
        np.testing.assert_allclose(told["world_min"], volume.corners.min(axis=0))
        np.testing.assert_allclose(told["world_max"], volume.corners.max(axis=0))
    np.save(tmp_path / "a.npy", volume.data)
    assert cli("info", tmp_path / "a.npy").code == 0
    np.save(tmp_path / "b.npy", np.zeros((2, 3, 4, 3), np.uint8))
    assert cli("info", tmp_path / "b.npy").code == 0
