"""Cast rays through a volume."""

import math

import numpy as np

from nodegraph import Bool, Camera, Choice, Color, Float, Input, Light, Output, Processor, TransferFunction, data
from nodegraph.data import Image, Volume
from nodegraph.errors import PortError
from nodegraph.ports import channels, has_components

TABLE_SIZE = 2048
MODES = ("composite", "maximum", "first_hit", "iso")
SURFACES = ("composite", "first_hit", "iso")


class Raycast(Processor):
    """Integrate, or search, a scalar volume along the ray of each pixel.

    Sample k of a ray lies at (k + 1/2) step from the eye, whatever the volume and its crop; the first and the last
    sample of a ray weigh the length that they cover. A sample of extinction e over a length s hides 1 - exp(-e s).
    So moving a proxy geometry, or volume and camera together, changes nothing. Voxels that are not a number are
    transparent.

    - *composite*: emission and absorption, front to back. Depth is where ``depth_opacity`` is hidden.
    - *maximum*: the greatest value of the ray, coloured by the transfer function with its own opacity.
    - *first_hit*: the first point whose extinction reaches ``hit_extinction``, opaque.
    - *iso*: the first point of value ``iso_value``, opaque. Both roots are refined by bisection.

    Source: Rezk-Salama 2001, R01, R02, R13, I01; Lindemann 2014, L01, L02, L24; Schlosser 2009, C01.
    """

    volume = Input(Volume, doc="Scalar field.", accepts=[has_components(1)])
    gradient = Input(
        Volume,
        required=False,
        doc="World-space gradient of the field, for illumination; without it, central differences on the fly.",
        accepts=[has_components(3, 4)],
    )
    interval = Input(
        Image,
        required=False,
        doc="Entry and exit distances of each ray, mm from the eye; without them, the whole volume.",
        accepts=[channels(2)],
    )
    image = Output(Image, doc="Linear premultiplied RGBA, with depth in mm along the view axis.")

    mode = Choice(*MODES, doc="What is made of the samples of a ray.")
    camera = Camera(doc="Where the eye is.")
    transfer_function = TransferFunction(
        data.TransferFunction([(0.0, (1.0, 1.0, 1.0), 0.0), (1.0, (1.0, 1.0, 1.0), 0.5)]),
        visible_if={"mode": ("composite", "maximum", "first_hit")},
        doc="Colour and extinction by value.",
    )
    step = Float(
        0.5, min=1e-3, max=1e3, soft_min=0.1, soft_max=4.0, unit="voxel", quality="lower",
        doc="Distance of samples, in units of the least voxel spacing.",
    )  # fmt: skip
    termination = Float(
        0.999, min=0.5, max=1.0, quality="higher", visible_if={"mode": "composite"},
        doc="A ray ends when it has hidden this much; the error is at most 1 - termination. 1 casts all of it.",
    )  # fmt: skip
    depth_opacity = Float(
        0.5, min=0.0, max=0.999, visible_if={"mode": "composite"}, doc="Depth is where this much is hidden."
    )
    hit_extinction = Float(
        0.05, min=0.0, soft_max=1.0, unit="1/mm", visible_if={"mode": "first_hit"}, doc="What counts as a hit."
    )
    iso_value = Float(0.5, visible_if={"mode": "iso"}, doc="Value of the surface, in the volume's unit.")
    iso_color = Color((0.8, 0.75, 0.7), visible_if={"mode": "iso"}, doc="Linear colour of the surface.")
    lit = Bool(True, visible_if={"mode": SURFACES}, doc="Illuminate by the Phong model.")
    light = Light(visible_if={"lit": True, "mode": SURFACES}, doc="The lamp.")
    ambient = Float(
        0.15, min=0.0, soft_max=1.0, visible_if={"lit": True, "mode": SURFACES}, doc="Light from all around."
    )
    diffuse = Float(0.85, min=0.0, soft_max=1.0, visible_if={"lit": True, "mode": SURFACES}, doc="Matt reflection.")
    specular = Float(0.25, min=0.0, soft_max=1.0, visible_if={"lit": True, "mode": SURFACES}, doc="Glossy reflection.")
    shininess = Float(
        25.0, min=1.0, soft_max=200.0, visible_if={"lit": True, "mode": SURFACES}, doc="Narrowness of the gloss."
    )

    def process(
        self, volume, gradient, interval, mode, camera, transfer_function, step, termination, depth_opacity,
        hit_extinction, iso_value, iso_color, lit, light, ambient, diffuse, specular, shininess, *, size, device,
    ):  # fmt: skip
        lit = lit and mode in SURFACES
        if interval is not None and interval.size != size:
            raise PortError(f"interval: expected {size[0]}x{size[1]} pixels, got {interval.size[0]}x{interval.size[1]}")
        if gradient is not None and not gradient.is_same_grid(volume):
            raise PortError("gradient: it lies on another grid than the volume; compute it from this volume")
        step_length = step * float(volume.spacing.min())
        # Rays start a whole number of steps from the eye, just before the volume: single precision counts from there.
        steps = max(0.0, math.floor(volume.distance_from(camera) / step_length) - 1.0)
        # Values are taken relative to one of the field's own, for the same reason.
        level = volume.origin
        bindings = {
            "volume": volume.less(level),
            "camera": camera.rays(size, volume.world_to_index, steps * step_length),
            "step_length": step_length,
            "table": transfer_function.table(TABLE_SIZE),
            "lookup": transfer_function.lookup(TABLE_SIZE, level),
        }
        if mode == "composite":
            bindings |= {"depth_opacity": depth_opacity}
            if termination < 1.0:
                # A ray must not end before its depth is known.
                bindings |= {"termination": max(termination, depth_opacity)}
        elif mode == "maximum":
            bindings |= {"reference_length": transfer_function.reference_length}
        elif mode == "first_hit":
            bindings |= {"hit_extinction": hit_extinction}
        else:
            bindings |= {"iso_value": iso_value - level, "iso_color": iso_color}
        if interval is not None:
            bindings |= {"interval": interval}
        if lit:
            to_eye = camera.eye_to_world[:3, :3].T
            if gradient is None:
                to_eye = to_eye @ volume.world_to_index[:3, :3].T
            else:
                bindings |= {"gradient": gradient}
            material = {"ambient": ambient, "diffuse": diffuse, "specular": specular, "shininess": shininess}
            bindings |= {
                "light": light.in_eye_space(camera),
                "material": material,
                "to_eye": to_eye / np.abs(to_eye).max(),
            }
        defines = {
            "MODE": MODES.index(mode),
            "LIT": lit,
            "GRADIENT": lit and gradient is not None,
            "INTERVAL": interval is not None,
            "TERMINATION": mode == "composite" and termination < 1.0,
            "FINITE": volume.dtype.kind in "iu",
        }
        # What a ray costs is its samples; a few hundred are nothing out of the ordinary.
        samples = float(np.linalg.norm(volume.corners[7] - volume.corners[0])) / step_length
        # A lit sample takes up to four turns of loops, as some drivers count (branches are printed as loops).
        turns = samples * (4 if lit and mode == "composite" else 1) + 100
        work = max(samples / 500.0, 0.1)
        result = device.run("render/raycast", size, defines=defines, work=work, turns=turns, **bindings)
        return Image(result.color, result.depth)
