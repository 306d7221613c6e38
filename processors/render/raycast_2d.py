"""Cast rays through a volume, classified by value and gradient magnitude."""

from nodegraph import Bool, Camera, Choice, Float, Input, Int, Light, Output, Processor, TransferFunction2D, data
from nodegraph.compute import blockwise
from nodegraph.compute.casting import ENLARGE, SKIP_OPACITY, VALUE_ERROR, Casting, table, within
from nodegraph.data import Image, Volume, bricks, preintegration
from nodegraph.data.bricks import value_ranges
from nodegraph.data.gradients import visible_samples
from nodegraph.ports import channels, has_components
from nodegraph.requests import Request, coarseness, coarser

INTEGRATORS = ("midpoint", "gauss2", "gauss3")
KERNEL = "render/raycast"


class Raycast2D(Processor):
    """Integrate a scalar volume along the ray of each pixel; what is seen depends on value and gradient magnitude.

    So a boundary is told from the inside of a material of the same value. Rays, segments, light and termination are
    those of `render.raycast` in composite mode. The magnitude is in value units per mm, of central differences over
    two voxels. Where it is not a finite number, or the value is not, nothing is seen.

    *midpoint* takes one sample of each segment: order 2 where all is smooth, 1 where the transfer function is steep.
    *gauss2* and *gauss3* take two and three points by Gauss and Legendre, order 4 and 6 where everything is smooth. The
    picture converges with the step and with ``table_size``: an edge that is not soft is one cell of the table wide.

    Source: Rezk-Salama 2001, T06, R01; Orhun 2004, OR-26, OR-14; Schlosser 2009, A09, C06.
    """

    kernels = (KERNEL, ENLARGE)

    volume = Input(Volume, doc="Scalar field.", accepts=[has_components(1)])
    gradient = Input(
        Volume,
        required=False,
        doc="World-space gradient of the field, per mm; without it, central differences.",
        accepts=[has_components(3, 4)],
    )
    interval = Input(
        Image,
        required=False,
        doc="Entry and exit distances of each ray, mm from the eye; without them, the whole volume.",
        accepts=[channels(2)],
    )
    image = Output(Image, doc="Linear premultiplied RGBA, with depth in mm along the view axis.")

    camera = Camera(doc="Where the eye is.")
    transfer_function = TransferFunction2D(
        data.TransferFunction2D([data.Trapezoid.rectangle((0.0, 1.0), (0.1, 1.0), (1.0, 1.0, 1.0), 0.5, 0.5)]),
        doc="Colour and extinction by value and gradient magnitude.",
    )
    integrator = Choice(
        *INTEGRATORS, quality=INTEGRATORS, doc="How many points of each segment of a ray are looked at."
    )
    step = Float(
        0.5, min=1e-3, max=1e3, soft_min=0.1, soft_max=4.0, unit="voxel", quality="lower",
        doc="Length of the segments, in units of the least voxel spacing.",
    )  # fmt: skip
    table_size = Int(
        256, min=8, max=2048, quality="higher", reference=2048,
        doc="Columns and rows of the table that the transfer function is read from.",
    )  # fmt: skip
    termination = Float(
        0.999, min=0.5, max=1.0, quality="higher", reference=1.0,
        doc="A ray ends when it has hidden this much; the error is at most 1 - termination. 1 casts all of it.",
    )  # fmt: skip
    value_error = Float(
        0.0, min=0.0, max=1.0, soft_max=0.01, quality="lower", reference=0.0,
        doc=VALUE_ERROR,
    )  # fmt: skip
    skip = Bool(
        True,
        doc="Leave out bricks of 4 voxels whose values are seen at no magnitude. Alone it changes only the time.",
    )
    skip_opacity = Float(
        0.0, min=0.0, max=0.999, soft_max=0.25, quality="lower", reference=0.0, visible_if={"skip": True},
        doc=SKIP_OPACITY,
    )  # fmt: skip
    gradients = Choice(
        "automatic", "on_the_fly", "precomputed",
        doc="Whether differences of voxels are taken at each sample, or once for all of them. It changes nothing but "
        "time, memory and rounding; beside voxels that are not finite, light may differ.",
    )  # fmt: skip
    depth_opacity = Float(0.5, min=0.0, max=0.999, doc="Depth is where this much is hidden.")
    lit = Bool(True, doc="Illuminate by the Phong model.")
    light = Light(visible_if={"lit": True}, doc="The lamp.")
    ambient = Float(0.15, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Light from all around.")
    diffuse = Float(0.85, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Matt reflection.")
    specular = Float(0.25, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Glossy reflection.")
    shininess = Float(25.0, min=1.0, soft_max=200.0, visible_if={"lit": True}, doc="Narrowness of the gloss.")

    def needs(self, size, quality, wanted, params):
        small, _ = coarser(size, params["step"], coarseness(quality))
        # What is above the interval has the size that is cast to go by, and must not be made coarser once more.
        return {} if small == size else {"interval": Request(small, "final")}

    def process(
        self, volume, gradient, interval, camera, transfer_function, integrator, step, table_size, termination,
        value_error, skip, skip_opacity, gradients, depth_opacity, lit, light, ambient, diffuse, specular, shininess,
        *, size, quality, device, memo, explain, progress,
    ):  # fmt: skip
        whole = size
        if interval is None or interval.size != whole:
            # An interval of the whole size, as a script may bring it, leaves no choice.
            size, step = coarser(whole, step, coarseness(quality))
        volume = within(value_error, volume, device, memo, explain)
        frame = Casting(device, volume, camera, size, step, interval, gradient)
        frame.interleave(whole)
        bindings, defines = frame.bindings, frame.defines
        bindings |= {
            "table": memo(table, transfer_function, table_size, table_size),
            "lookup_2d": transfer_function.lookup(table_size, table_size, frame.level),
            "to_eye": frame.to_eye(),
            "depth_opacity": depth_opacity,
        }
        defines |= {"BY_GRADIENT": True, "TERMINATION": termination < 1.0}
        if termination < 1.0:
            # A ray must not end before its depth is known.
            bindings["termination"] = max(termination, depth_opacity)
        if integrator != "midpoint":
            order = INTEGRATORS.index(integrator) + 1
            nodes, weights, before = preintegration.gauss_rule(order)
            bindings |= {"nodes": nodes, "weights": weights, "before": before.ravel()}
            defines |= {"INTEGRATOR": 3, "ORDER": order}
        if lit:
            frame.illuminate(light, ambient=ambient, diffuse=diffuse, specular=specular, shininess=shininess)

        visible, share = None, 1.0
        if skip:
            ranges = memo(value_ranges, volume, blockwise.GROUP) if frame.streamed else memo(value_ranges, volume)
            least = frame.extinction_of(skip_opacity)
            if frame.streamed:
                found = visible = memo(visible_groups, ranges, transfer_function, table_size, least)
            else:
                found = memo(leaps, ranges, transfer_function, table_size, least)
            share = frame.leave_out(found, skip_opacity, explain)
        shown = visible_samples(volume, camera, size, frame.step_length, share)
        frame.choose_gradients(gradients, shown, memo, explain, coarse=size != whole)
        if lit:
            defines["ALL_LIT"] = frame.lights_all(dense=skip and found is None)

        # How many turns of loops a ray may take at most, as some drivers count.
        turns = frame.samples * (4.0 if lit else 1.3 if skip else 1.0) + 100
        frame.stream(KERNEL, explain, visible=visible, looks=0.0 if integrator == "midpoint" else 0.5)
        return frame.picture(frame.cast(KERNEL, turns, progress), whole)


def leaps(ranges, function, table_size, least):
    """How far a ray may leap from each brick; None where it is not worth asking."""
    visible = visible_groups(ranges, function, table_size, least)
    return None if visible is None else bricks.Leaps.over(visible)


def visible_groups(ranges, function, table_size, least):
    """The bricks, or groups of bricks, with values that at some magnitude hide more than ``least`` per mm.

    None where nearly all have.
    """
    greatest, lookup = function.greatest(table_size, table_size), function.lookup(table_size, table_size)[:2]
    return bricks.unless_most(bricks.visible_bricks(ranges.data, greatest, lookup, least))
