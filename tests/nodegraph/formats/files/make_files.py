"""How the files of this folder were written: SimpleITK 2.5.7 (ITK 5.4) and ImageMagick. No test runs this.

Voxel (x, y, z) of the scalar files holds x + 10 y + 100 z - 50; component c of the vector files holds that plus 1000 c.
"""

import math

import numpy as np
import SimpleITK as sitk

Z, Y, X = np.meshgrid(np.arange(4), np.arange(5), np.arange(6), indexing="ij")
SCALAR = (X + 10 * Y + 100 * Z - 50).astype(np.int16)
C, S = math.cos(0.3), math.sin(0.3)


def place(image):
    """Turned about x by 0.3 rad, anisotropic, off the origin; all in LPS mm."""
    image.SetSpacing((0.5, 1.25, 3.0))
    image.SetOrigin((-12.5, 40.25, 1000.125))
    image.SetDirection((1, 0, 0, 0, C, -S, 0, S, C))
    return image


scalar = place(sitk.GetImageFromArray(SCALAR))
vector = place(
    sitk.GetImageFromArray(np.stack([SCALAR + 1000 * c for c in range(3)], -1).astype(np.float32), isVector=True)
)
for name in ("itk_scalar.nii", "itk_scalar.nii.gz", "itk_scalar.nrrd", "itk_scalar.nhdr"):
    sitk.WriteImage(scalar, name, useCompression=not name.endswith((".nii", ".nhdr")))
for name in ("itk_vector.nii.gz", "itk_vector.nrrd"):
    sitk.WriteImage(vector, name, useCompression=True)
series = sitk.JoinSeries([place(sitk.GetImageFromArray((SCALAR + 7 * t).astype(np.uint8))) for t in range(3)], 0.0, 2.0)
sitk.WriteImage(series, "itk_series.nii.gz", useCompression=True)
color = np.zeros((4, 6, 4), np.uint8)
color[..., 0] = np.arange(6) * 51
color[..., 1] = np.arange(4)[:, None] * 85
color[..., 3] = 255 - 40 * np.arange(6)
sitk.WriteImage(sitk.GetImageFromArray(color, isVector=True), "itk_rgba.png")
sitk.WriteImage(sitk.GetImageFromArray((np.arange(24).reshape(4, 6) * 2849).astype(np.uint16)), "itk_grey16.png")

# magick_palette.png, magick_grey_alpha.png: ImageMagick 6.9,
#   convert -size 5x3 gradient:red-blue -type Palette -interlace PNG magick_palette.png
#   convert -size 5x3 xc:'gray(50%)' -alpha set -channel A -evaluate set 25% -define png:color-type=4 \
#     magick_grey_alpha.png

# ome_zarr_0.4.ome.zarr, ome_zarr_0.5.ome.zarr: ome-zarr 0.18.0 (zarr 3.1), SCALAR, + 1000, + 2000 as three channels,
#   axes = [{"name": "c", "type": "channel"}, *({"name": n, "type": "space", "unit": "micrometer"} for n in "zyx")]
#   write_image(channels, name, fmt=FormatV04() or FormatV05(), axes=axes, scale_factors=[2],
#               scale={"c": 1.0, "z": 3.0, "y": 1.25, "x": 0.5}, axes_units={n: "micrometer" for n in "zyx"})
