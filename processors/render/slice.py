"""Cut a volume with a plane."""

import numpy as np

from nodegraph import Choice, Float, Input, Interval, Output, Plane, Processor, TransferFunction, data
from nodegraph.compute.casting import ENLARGE, enlarged
from nodegraph.data import Image, Volume
from nodegraph.data.space import transform_points
from nodegraph.ports import has_components
from nodegraph.requests import coarseness, coarser

KERNEL = "render/slice"
TABLE_SIZE = 2048


class Slice(Processor):
    """Show the values of a scalar volume on any plane, in grey or by a transfer function.

    The plane's origin is in the middle of the picture. Up is the world's z as far as the plane allows, else
    its -y (towards the front of the patient). Outside the volume the picture is transparent.
    Source: Rezk-Salama 2001, R18 (trilinear mode); Orhun 2004, OR-10.
    """

    kernels = (KERNEL, ENLARGE)

    volume = Input(Volume, doc="Scalar field.", accepts=[has_components(1)])
    image = Output(Image, doc="Linear premultiplied RGBA.")

    plane = Plane(doc="Where to cut; its normal looks at the viewer.")
    height = Float(0.0, min=0.0, unit="mm", doc="What the picture covers from bottom to top; 0 shows the whole volume.")
    interpolation = Choice("linear", "nearest", doc="How values between voxel centres are found.")
    coloring = Choice("window", "transfer_function", doc="How values become colours.")
    window = Interval(
        (0.0, 0.0), visible_if={"coloring": "window"}, doc="Values shown black and white; (0, 0) is the whole range."
    )
    transfer_function = TransferFunction(
        data.TransferFunction([(0.0, (0.0, 0.0, 0.0), 0.0), (1.0, (1.0, 1.0, 1.0), 1.0)]),
        visible_if={"coloring": "transfer_function"},
        doc="Colour and extinction by value; the slice is as thick as the reference length.",
    )

    def process(
        self, volume, plane, height, interpolation, coloring, window, transfer_function, *, size, quality, device
    ):
        right, up = plane.axes
        origin = np.asarray(plane.origin)
        if height == 0.0:
            offsets = volume.corners - origin
            tall, wide = 2 * np.abs(offsets @ up).max(), 2 * np.abs(offsets @ right).max()
            height = max(tall, wide * size[1] / size[0])
        whole = size
        size, _ = coarser(whole, None, coarseness(quality))
        pixel = height / size[1]
        corner = origin - right * pixel * (size[0] - 1) / 2 + up * pixel * (size[1] - 1) / 2
        linear = volume.world_to_index[:3, :3]
        level = volume.origin
        bindings = {
            "volume": volume.less(level),
            "corner": transform_points(volume.world_to_index, corner),
            "right": linear @ right * pixel,
            "down": linear @ up * -pixel,
        }
        if coloring == "window":
            low, high = volume.range if tuple(window) == (0.0, 0.0) else window
            # A window without width is a threshold; the least width that single precision can divide by.
            scale = 1.0 / max(high - low, 1e-30 + 1e-7 * abs(high - level))
            bindings |= {"window": (low - level, scale)}
        else:
            bindings |= {
                "table": transfer_function.table(TABLE_SIZE),
                "lookup": transfer_function.lookup(TABLE_SIZE, level),
                "thickness": transfer_function.reference_length,
            }
        defines = {
            "NEAREST": interpolation == "nearest",
            "WINDOW": coloring == "window",
            "FINITE": volume.dtype.kind in "iu",
        }
        return enlarged(Image(device.run(KERNEL, size, defines=defines, **bindings)), whole, device)
