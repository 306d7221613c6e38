"""Write a volume to a file."""

from __future__ import annotations

from nodegraph import Bool, File, Input, Processor
from nodegraph.data import Volume
from nodegraph.errors import ParameterError


class VolumeFile(Processor):
    """Write a volume to a NIfTI, NRRD or NumPy file, or to any format that a plug-in brings.

    The stored numbers are written in their own type, with their place in the world. NIfTI and .npz keep a scaling of
    the values; NRRD and .npy know none, so the real values are written there. The file appears whole or not at all; an
    older one is replaced.
    """

    effect = True

    volume = Input(Volume, doc="What is written.")

    path = File(
        write=True,
        suffixes=(".nii.gz", ".nii", ".nrrd", ".npz", ".npy"),
        doc="The file. A relative path is relative to the workspace.",
    )
    compress = Bool(True, doc="Compress NRRD and .npz files. NIfTI says it in its name: .nii.gz; .npy never does.")

    def process(self, volume, path, compress):
        from nodegraph import formats

        if not path:
            raise ParameterError("path: no file is named; name one, for example smoothed.nii.gz")
        has_choice = path.lower().endswith((".nrrd", ".npz"))
        formats.write(volume, path, **({"compress": compress} if has_choice else {}))
