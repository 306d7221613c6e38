"""Compare two pictures."""

from typing import NamedTuple

import numpy as np

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Image, Table
from nodegraph.errors import PortError
from nodegraph.ports import channels


class Compared(NamedTuple):
    difference: Image
    measures: Table


class Difference(Processor):
    """Show and measure how far a picture is from a reference of the same size.

    Measured on linear premultiplied RGBA: greatest and mean absolute difference, root mean square, peak
    signal-to-noise ratio (peak 1), and the 99.9 percentile of the greatest difference of each pixel.
    """

    image = Input(Image, doc="Linear premultiplied RGBA.", accepts=[channels(4)])
    reference = Input(Image, doc="The same scene, same size.", accepts=[channels(4)])
    difference = Output(Image, doc="Absolute difference times the gain, opaque; a difference of alpha is grey.")
    measures = Output(Table, doc="One row: maximum, mean, rmse, psnr (dB), percentile_99_9.")

    gain = Float(10.0, min=0.0, soft_max=1000.0, doc="Amplification of the picture; the measures are not amplified.")

    def process(self, image, reference, gain, *, wanted, device):
        if image.size != reference.size:
            raise PortError(f"reference: expected {image.size[0]}x{image.size[1]} pixels like the image, got "
                            f"{reference.size[0]}x{reference.size[1]}")  # fmt: skip
        picture = measures = None
        if "difference" in wanted:
            picture = Image(
                device.run(
                    "image/difference",
                    image.size,
                    image=image.color_buffer,
                    reference=reference.color_buffer,
                    gain=gain,
                )
            )
        if "measures" in wanted:
            measures = measure(image.color, reference.color)
        return Compared(picture, measures)


def measure(color, reference):
    """The measures of two (h, w, 4) arrays as a table of one row."""
    with np.errstate(invalid="ignore"):  # inf - inf is not a number, and so are the measures then
        error = np.abs(color.astype(np.float64) - reference)
    rmse = float(np.sqrt(np.mean(error * error)))
    return Table(
        {
            "maximum": [float(error.max())],
            "mean": [float(error.mean())],
            "rmse": [rmse],
            "psnr": [float(-20.0 * np.log10(rmse)) if rmse > 0.0 else float("inf")],
            "percentile_99_9": [float(np.percentile(error.max(axis=2), 99.9))],
        },
        units={"psnr": "dB"},
    )
