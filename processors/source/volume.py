"""Read a volume from a file."""

from __future__ import annotations

import numpy as np

from nodegraph import Choice, File, Float, Int, Output, Processor
from nodegraph.data import Volume as VolumeData
from nodegraph.errors import ParameterError


class Volume(Processor):
    """Read a volume from a NIfTI, NRRD, NumPy or OME-Zarr file, or from any format that a plug-in brings.

    The stored numbers are kept as they are; a scaling in the header becomes the mapping of the volume. Positions are
    converted to millimetres in LPS, so that files of different programs lie where they should. Uncompressed data is
    mapped and only read where it is needed; of OME-Zarr only the chunks that somebody asks for are read.
    """

    volume = Output(VolumeData, doc="The field, in the type in which it is stored.")

    path = File(
        suffixes=(".nii", ".nii.gz", ".nrrd", ".nhdr", ".npy", ".npz", ".zarr"),
        doc="The file (OME-Zarr: the folder). A relative path is relative to the workspace.",
    )
    fourth_axis = Choice(
        "auto",
        "time",
        "components",
        doc="What a fourth axis means. Automatic: what the header says, and time where it says nothing.",
    )
    time = Int(0, min=0, soft_max=100, doc="Index of the time step, where the file holds several.")
    component = Int(
        -1, min=-1, soft_max=8, doc="Index of the one component to keep, where voxels hold several; -1 keeps all."
    )
    level = Int(
        0, min=0, soft_max=8, doc="Which resolution, where the file holds the volume at several; 0 is the finest."
    )
    length_scale = Float(
        1.0,
        min=1e-9,
        max=1e9,
        soft_min=0.001,
        soft_max=1000.0,
        doc="Factor on all lengths, for a file whose unit is not what it says: 1000 if it holds metres.",
    )

    def process(self, path, fourth_axis, time, component, level, length_scale):
        from nodegraph import formats

        if not path:
            raise ParameterError("path: no file is chosen; name one, for example workspaces/data/cta_chest.nii.gz")
        options = {} if fourth_axis == "auto" else {"fourth_axis": fourth_axis}
        if time:
            options["time"] = time
        if level:
            options["level"] = level
        volume = formats.read(path, **options)
        if not isinstance(volume, VolumeData):
            raise ParameterError(f"path: {path} holds {volume.kind}, not a volume; choose a volume file")
        if component >= volume.components:
            raise ParameterError(f"component: {component} is outside -1..{volume.components - 1}")
        if component >= 0:
            volume = volume.component(component)
        if length_scale != 1.0:
            scaled = np.diag([length_scale] * 3 + [1.0]) @ volume.index_to_world
            volume = VolumeData(volume.buffer, scaled, volume.mapping)
        return volume
