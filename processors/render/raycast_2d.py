"""Cast rays through a volume, classified by value and gradient magnitude."""

from nodegraph import Bool, Camera, Choice, Float, Input, Int, Light, Output, Processor, TransferFunction2D, data
from nodegraph.compute import blockwise
from nodegraph.compute.casting import ENLARGE, SKIP_OPACITY, VALUE_ERROR, Casting, gauss_points, table, within
from nodegraph.data import Image, Volume, bricks
from nodegraph.data.areas import areas
from nodegraph.data.bricks import value_ranges
from nodegraph.data.gradients import visible_samples
from nodegraph.ports import channels, has_components
from nodegraph.requests import Request, coarseness, coarser

INTEGRATORS = ("midpoint", "trapezoid", "preintegrated", "gauss2", "gauss3", "adaptive", "cellwise")
KERNEL = "render/raycast"
KERNELS = {"cellwise": "render/raycast_cellwise_2d", "adaptive": "render/raycast_adaptive_2d"}
POINTS = {"gauss2": 2, "gauss3": 3}
TABULATED = ("midpoint", "trapezoid", "gauss2", "gauss3")
"""Those that read the transfer function from a table; the others ask its areas."""
LOOKS_AT = {"midpoint": 0.0, "cellwise": 0.0}
"""Steps from the middle of a segment to the farthest point that is looked at for it; 1/2 where nothing else is said."""


class Raycast2D(Processor):
    """Integrate a scalar volume along the ray of each pixel; what is seen depends on value and gradient magnitude.

    So a boundary is told from the inside of a material of the same value. Rays, segments, light and termination are
    those of `render.raycast` in composite mode. The magnitude is in value units per mm, of central differences over
    two voxels. Where it is not a finite number, or the value is not, nothing is seen.

    What is made of a segment:

    - *midpoint*: one sample. Order 2 where everything is smooth, 1 where the transfer function is steep.
    - *trapezoid*: both ends.
    - *preintegrated*: both ends, and what the areas hold on a straight line between them, in (value, magnitude):
      order 2 also for edges that are not soft.
    - *gauss2*, *gauss3*: two or three points by Gauss and Legendre, order 4 and 6 where everything is smooth.
    - *cellwise*: cut at cell faces and wherever an edge of an area may be met, ``order`` points in each piece, which
      are halved until they agree: exact but for rounding and ``termination``, and ``order`` changes hardly more than
      the time.
    - *adaptive*: segments are halved until halves and whole agree within ``tolerance``.

    Of those that go by segments *preintegrated* errs least where areas have hard edges, *gauss2* and *gauss3* where
    they are soft. *midpoint*, *trapezoid*, *gauss2* and *gauss3* read a table, and converge with ``table_size``, too:
    an edge that is not soft is one of its cells wide. The others ask the areas themselves, which takes longer the more
    there are. On a processor *cellwise* and *adaptive* are two to four times as fast by OpenCL as by OpenGL.

    Source: Rezk-Salama 2001, T06, R01; Orhun 2004, OR-26, OR-14; Schlosser 2009, A09, C06.
    """

    kernels = (KERNEL, *KERNELS.values(), ENLARGE)

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
        *INTEGRATORS, quality=INTEGRATORS, reference="cellwise", doc="What is made of each segment of a ray."
    )
    step = Float(
        0.5, min=1e-3, max=1e3, soft_min=0.1, soft_max=4.0, unit="voxel", quality="lower",
        visible_if={"integrator": INTEGRATORS[:6]},
        doc="Length of the segments, in units of the least voxel spacing.",
    )  # fmt: skip
    order = Int(
        3, min=1, max=12, quality="higher", reference=(3, 5, 8), visible_if={"integrator": "cellwise"},
        doc="Gauss-Legendre points in each piece of a ray: pieces of a low order are halved more often.",
    )  # fmt: skip
    tolerance = Float(
        1e-3, min=1e-7, max=1.0, quality="lower", visible_if={"integrator": "adaptive"},
        doc="What halving a segment may still change of colour, with its light, and opacity, summed over the ray. It "
        "is an estimate: what is narrower than a segment, or a side that turns to the lamp within one, may be "
        "passed by.",
    )  # fmt: skip
    table_size = Int(
        256, min=8, max=2048, quality="higher", reference=2048, visible_if={"integrator": TABULATED},
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
        "time, memory and rounding; but beside voxels that are not finite it decides what is seen, so that there "
        "automatic is on_the_fly.",
    )  # fmt: skip
    depth_opacity = Float(0.5, min=0.0, max=0.999, doc="Depth is where this much is hidden.")
    lit = Bool(True, doc="Illuminate by the Phong model.")
    light = Light(visible_if={"lit": True}, doc="The lamp.")
    ambient = Float(0.15, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Light from all around.")
    diffuse = Float(0.85, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Matt reflection.")
    specular = Float(0.25, min=0.0, soft_max=1.0, visible_if={"lit": True}, doc="Glossy reflection.")
    shininess = Float(25.0, min=1.0, soft_max=200.0, visible_if={"lit": True}, doc="Narrowness of the gloss.")

    def needs(self, size, quality, wanted, params):
        exact = params["integrator"] == "cellwise"
        small, _ = coarser(size, None if exact else params["step"], coarseness(quality))
        # What is above the interval has the size that is cast to go by, and must not be made coarser once more.
        return {} if small == size else {"interval": Request(small, "final")}

    def process(
        self, volume, gradient, interval, camera, transfer_function, integrator, step, order, tolerance, table_size,
        termination, value_error, skip, skip_opacity, gradients, depth_opacity, lit, light, ambient, diffuse, specular,
        shininess,
        *, size, quality, device, memo, explain, progress,
    ):  # fmt: skip
        whole = size
        if interval is None or interval.size != whole:
            # An interval of the whole size, as a script may bring it, leaves no choice.
            size, longer = coarser(whole, None if integrator == "cellwise" else step, coarseness(quality))
            step = longer or step
        volume = within(value_error, volume, device, memo, explain)
        frame = Casting(device, volume, camera, size, step, interval, gradient)
        bindings, defines = frame.bindings, frame.defines
        bindings |= {"to_eye": frame.to_eye(), "depth_opacity": depth_opacity}
        defines |= {"TERMINATION": termination < 1.0}
        if termination < 1.0:
            # A ray must not end before its depth is known.
            bindings["termination"] = max(termination, depth_opacity)
        kernel = KERNELS.get(integrator, KERNEL)
        if kernel == KERNEL:
            frame.interleave(whole)
            # The other kernels are made for nothing else.
            defines |= {"BY_GRADIENT": True, "INTEGRATOR": 3 if integrator in POINTS else INTEGRATORS.index(integrator)}
        if integrator in TABULATED:
            bindings |= {
                "table": memo(table, transfer_function, table_size, table_size),
                "lookup_2d": transfer_function.lookup(table_size, table_size, frame.level),
            }
        else:
            bindings["areas"] = areas(transfer_function, frame.level)
        points = order if integrator == "cellwise" else POINTS.get(integrator)
        if points is not None:
            bindings |= gauss_points(points)
            defines["ORDER"] = points
        if integrator == "adaptive":
            bindings["tolerance"] = tolerance
        if lit:
            frame.illuminate(light, ambient=ambient, diffuse=diffuse, specular=specular, shininess=shininess)

        visible, share = None, 1.0
        if skip:
            ranges = memo(value_ranges, volume, blockwise.GROUP) if frame.streamed else memo(value_ranges, volume)
            least = frame.extinction_of(skip_opacity)
            rows = table_size if integrator in TABULATED else None
            if frame.streamed:
                found = visible = memo(visible_groups, ranges, transfer_function, rows, least)
            else:
                found = memo(leaps, ranges, transfer_function, rows, least)
            share = frame.leave_out(found, skip_opacity, explain)
        shown = visible_samples(volume, camera, size, frame.step_length, share)
        frame.choose_gradients(gradients, shown, memo, explain, coarse=size != whole, decisive=True)
        if lit and kernel == KERNEL:
            defines["ALL_LIT"] = frame.lights_all(dense=skip and found is None)

        # How many turns of loops a ray may take at most, as some drivers count.
        turns = frame.samples * (4.0 if lit else 1.3 if skip else 1.0) + 100
        if integrator == "preintegrated":
            turns += frame.samples * len(transfer_function.areas) * (2.0 if lit else 1.0)
        frame.stream(kernel, explain, visible=visible, looks=LOOKS_AT.get(integrator, 0.5))
        result = frame.cast(kernel, turns, progress)
        if kernel != KERNEL:
            frame.refuse_unfinished(result, integrator)
        return frame.picture(result, whole)


def leaps(ranges, function, rows, least):
    """How far a ray may leap from each brick; None where it is not worth asking."""
    visible = visible_groups(ranges, function, rows, least)
    return None if visible is None else bricks.Leaps.over(visible)


def visible_groups(ranges, function, rows, least):
    """The bricks, or groups of bricks, with values that at some magnitude hide more than ``least`` per mm.

    By a table of ``rows`` rows and columns, or by the areas themselves where it is None. None where nearly all have.
    """
    if rows is None:
        return bricks.unless_most(bricks.visible_by_areas(ranges.data, function, least))
    greatest, lookup = function.greatest(rows, rows), function.lookup(rows, rows)[:2]
    return bricks.unless_most(bricks.visible_bricks(ranges.data, greatest, lookup, least))
