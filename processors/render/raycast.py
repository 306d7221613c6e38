"""Cast rays through a volume."""

from functools import partial

import numpy as np

from nodegraph import Bool, Camera, Choice, Color, Float, Input, Int, Light, Output, Processor, TransferFunction, data
from nodegraph.compute import blockwise
from nodegraph.compute.casting import ENLARGE, SKIP_OPACITY, VALUE_ERROR, Casting, gauss_points, table, within
from nodegraph.compute.sparse_pixels import SPARSE, cast_sparsely
from nodegraph.data import Buffer, Image, Volume, bands, bricks, preintegration
from nodegraph.data.bricks import value_ranges
from nodegraph.data.gradients import visible_samples
from nodegraph.ports import channels, has_components
from nodegraph.requests import Request, coarseness, coarser

MODES = ("composite", "maximum", "first_hit", "iso")
SURFACES = ("composite", "first_hit", "iso")
INTEGRATORS = ("midpoint", "trapezoid", "preintegrated", "gauss2", "gauss3", "adaptive", "cellwise")
KERNELS = {
    "composite": "render/raycast", "cellwise": "render/raycast_cellwise", "adaptive": "render/raycast_adaptive",
    "first_hit": "render/raycast_surface", "iso": "render/raycast_surface", "maximum": "render/raycast_maximum",
}  # fmt: skip
POINTS = {"gauss2": 2, "gauss3": 3}
UNBOUNDED = (KERNELS["cellwise"], KERNELS["adaptive"])
"""Kernels whose turns of loops are not known beforehand; where a ray was not cast to its end they return NaN."""
LOOKS_AT = {"midpoint": 0.0, "cellwise": 0.0, "maximum": 0.0, "first_hit": 1.5, "iso": 1.5}
"""Steps from the middle of a segment to the farthest point that is looked at for it; 1/2 where nothing else is said."""


class Raycast(Processor):
    """Integrate, or search, a scalar volume along the ray of each pixel.

    Segment k of a ray is the part from k to k + 1 steps from the eye, whatever the volume and its crop; the first and
    the last one are cut. A segment of optical depth d hides 1 - exp(-d). So moving a proxy geometry, or volume and
    camera together, changes nothing, and what cannot be seen is left out by whole segments. Voxels that are not a
    number are transparent.

    - *composite*: emission and absorption, front to back. Depth is where ``depth_opacity`` is hidden.
    - *maximum*: the greatest value of the ray, coloured by the transfer function with its own opacity.
    - *first_hit*: the first point whose extinction reaches ``hit_extinction``, opaque.
    - *iso*: the first point of value ``iso_value``, opaque. Both roots are refined by bisection.

    What is made of a segment in *composite*:

    - *midpoint*: one sample. Order 2 where everything is smooth, 1 where the transfer function is steep.
    - *trapezoid*: both ends.
    - *preintegrated*: both ends, and a table over pairs of values: order 2 also for steep transfer functions.
    - *gauss2*, *gauss3*: two or three points by Gauss and Legendre, order 4 and 6 where everything is smooth.
    - *cellwise*: cut at cell faces and where the value meets a key, ``order`` points in each piece. Slow and exact.
    - *adaptive*: segments are halved until halves and whole agree within ``tolerance``.

    Source: Rezk-Salama 2001, R01, R02, R13, I01, X12; Lindemann 2014, L01, L02, L24; Schlosser 2009, C01, C06;
    Orhun 2004, OR-61.
    """

    kernels = (*dict.fromkeys(KERNELS.values()), ENLARGE, SPARSE)

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
    integrator = Choice(
        *INTEGRATORS, visible_if={"mode": "composite"}, quality=INTEGRATORS, reference="cellwise",
        doc="What is made of each segment of a ray.",
    )  # fmt: skip
    step = Float(
        0.5, min=1e-3, max=1e3, soft_min=0.1, soft_max=4.0, unit="voxel", quality="lower",
        visible_if={"integrator": INTEGRATORS[:6]},
        doc="Length of the segments, in units of the least voxel spacing.",
    )  # fmt: skip
    order = Int(
        3, min=1, max=12, quality="higher", reference=(3, 5, 8),
        visible_if={"mode": "composite", "integrator": "cellwise"},
        doc="Gauss-Legendre points in each piece of a ray.",
    )  # fmt: skip
    tolerance = Float(
        1e-3, min=1e-7, max=1.0, quality="lower", visible_if={"mode": "composite", "integrator": "adaptive"},
        doc="What halving a segment may still change of colour, with its light, and opacity, summed over the ray. "
        "Jumps of the transfer function are met where they are. It is an estimate: what is narrower than a "
        "segment, or a side that turns to the lamp within one, may be passed by.",
    )  # fmt: skip
    table_size = Int(
        2048, min=2, max=8192, quality="higher",
        visible_if={"mode": MODES[:3], "integrator": ("midpoint", "trapezoid", "gauss2", "gauss3")},
        doc="Rows of the table that the transfer function is read from.",
    )  # fmt: skip
    pair_table_size = Int(
        256, min=2, max=2048, quality="higher",
        visible_if={"mode": "composite", "integrator": "preintegrated"},
        doc="Rows and columns of the table over pairs of values.",
    )  # fmt: skip
    termination = Float(
        0.999, min=0.5, max=1.0, quality="higher", reference=1.0, visible_if={"mode": "composite"},
        doc="A ray ends when it has hidden this much; the error is at most 1 - termination. 1 casts all of it.",
    )  # fmt: skip
    pixel_tolerance = Float(
        0.0, min=0.0, max=1.0, soft_max=0.1, quality="lower", reference=0.0,
        doc="Every fourth pixel of every fourth row is cast first; where the picture bends by less than this about a "
        "pixel, in colour and as a share in depth, it is interpolated. It bounds the error where nothing seen is "
        "narrower than four pixels: that may pass between them. It pays in large smooth pictures; where too few would "
        "be left out all are cast. 0 casts all.",
    )  # fmt: skip
    value_error = Float(
        0.0, min=0.0, max=1.0, soft_max=0.01, quality="lower", reference=0.0,
        doc=VALUE_ERROR,
    )  # fmt: skip
    skip = Bool(True, doc="Leave out what cannot be seen, by bricks of 4 voxels. Alone it changes only the time.")
    skip_opacity = Float(
        0.0, min=0.0, max=0.999, soft_max=0.25, quality="lower", reference=0.0,
        visible_if={"mode": "composite", "skip": True}, doc=SKIP_OPACITY,
    )  # fmt: skip
    gradients = Choice(
        "automatic", "on_the_fly", "precomputed", visible_if={"lit": True, "mode": SURFACES},
        doc="Whether differences of voxels are taken at each sample, or once for all of them. It changes nothing but "
        "time, memory and rounding; beside voxels that are not finite, light may differ.",
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

    def needs(self, size, quality, wanted, params):
        exact = params["mode"] == "composite" and params["integrator"] == "cellwise"
        small, _ = coarser(size, None if exact else params["step"], coarseness(quality))
        # What is above the interval has the size that is cast to go by, and must not be made coarser once more.
        asked = {} if small == size else {"interval": Request(small, "final")}
        return asked if params["mode"] in SURFACES and params["lit"] else asked | {"gradient": None}

    def process(
        self, volume, gradient, interval, mode, camera, transfer_function, integrator, step, order, tolerance,
        table_size, pair_table_size, termination, pixel_tolerance, value_error, skip, skip_opacity, gradients,
        depth_opacity, hit_extinction, iso_value, iso_color, lit, light, ambient, diffuse, specular, shininess,
        *, size, quality, device, memo, explain,
        progress,
    ):  # fmt: skip
        whole = size
        if interval is None or interval.size != whole:
            # An interval of the whole size, as a script may bring it, leaves no choice.
            exact = mode == "composite" and integrator == "cellwise"
            size, longer = coarser(whole, None if exact else step, coarseness(quality))
            step = longer or step
        volume = within(value_error, volume, device, memo, explain)
        frame = Casting(device, volume, camera, size, step, interval, gradient)
        level, bindings, defines = frame.level, frame.bindings, frame.defines
        lit = lit and mode in SURFACES
        if lit:
            frame.illuminate(light, ambient=ambient, diffuse=diffuse, specular=specular, shininess=shininess)
            to_eye = frame.to_eye()
            bindings["to_eye"] = to_eye / np.abs(to_eye).max()

        kernel = KERNELS.get(integrator, KERNELS[mode]) if mode == "composite" else KERNELS[mode]
        if mode == "composite":
            bindings["depth_opacity"] = depth_opacity
            defines["TERMINATION"] = termination < 1.0
            if termination < 1.0:
                # A ray must not end before its depth is known.
                bindings["termination"] = max(termination, depth_opacity)
            given, switches = _integration(
                transfer_function, integrator, level, frame.step_length, order, table_size, pair_table_size, memo
            )
            bindings.update(given)
            defines.update(switches)
            if kernel == KERNELS["composite"] and pixel_tolerance == 0.0:
                frame.interleave(whole)
            if integrator == "adaptive":
                bindings["tolerance"] = tolerance
        elif mode == "iso":
            bindings.update(iso_value=iso_value - level, iso_color=iso_color)
        else:
            bindings.update(_tabulated(transfer_function, table_size, level, memo))
            if mode == "maximum":
                bindings["reference_length"] = transfer_function.reference_length
            else:
                bindings["hit_extinction"] = hit_extinction
        if mode in ("iso", "first_hit"):
            defines["ISO"] = mode == "iso"

        visible = ranges = found = None
        share = 1.0
        if skip:
            ranges = memo(value_ranges, volume, blockwise.GROUP) if frame.streamed else memo(value_ranges, volume)
            if mode == "maximum":
                bindings["bricks"] = ranges.less(level)
                defines["SKIP"] = True
            else:
                what = integrator if mode == "composite" else mode
                rows = pair_table_size if what == "preintegrated" else table_size
                faint = skip_opacity if mode == "composite" else 0.0
                least = {"first_hit": hit_extinction, "iso": iso_value}.get(what, frame.extinction_of(faint))
                if frame.streamed:
                    visible = found = memo(visible_groups, ranges, transfer_function, what, rows, least, level)
                    ranges = None
                else:
                    found = memo(leaps, ranges, transfer_function, what, rows, least, level)
                share = frame.leave_out(found, faint, explain)

        if lit:
            shown = size[0] * size[1]
            if mode == "composite":
                shown = visible_samples(volume, camera, size, frame.step_length, share)
            frame.choose_gradients(gradients, shown, memo, explain, coarse=size != whole)
            if kernel == KERNELS["composite"]:
                defines["ALL_LIT"] = frame.lights_all(dense=skip and found is None)

        # How many turns of loops a ray may take at most, as some drivers count.
        turns = frame.samples * (4.0 if lit and mode == "composite" else 1.3 if "SKIP" in defines else 1.0) + 100
        looks = LOOKS_AT.get(integrator if mode == "composite" else mode, 0.5)
        frame.stream(kernel, explain, visible=visible, ranges=ranges, looks=looks, carries_best=mode == "maximum")
        if pixel_tolerance > 0.0 and frame.streamed:
            explain("every pixel is cast: blocks know no pixel_tolerance")
        cast = partial(frame.cast, kernel, turns, progress)
        sparse = pixel_tolerance > 0.0 and not frame.streamed
        result = cast_sparsely(cast, device, size, pixel_tolerance, explain) if sparse else cast()
        if kernel in UNBOUNDED:
            frame.refuse_unfinished(result, integrator)
        return frame.picture(result, whole)


def _tabulated(function, rows, level, memo):
    """The transfer function as a table over values less ``level``."""
    return {"table": memo(table, function, rows), "lookup": function.lookup(rows, level)}


def pair_table(function, rows, step_length):
    """Of `preintegration.pair_table`, as a buffer that stays on the device."""
    return Buffer(preintegration.pair_table(function, rows, step_length))


def _integration(function, integrator, level, step_length, order, table_size, pair_table_size, memo):
    """What an integrator reads of the transfer function, and the switches of its kernel."""
    if integrator == "cellwise":
        return _exactly(function, level) | gauss_points(order), {"ORDER": order}
    if integrator == "adaptive":
        rows, steps = bands.bands(function, level)
        return {"bands": rows}, {"STEPS": steps}
    if integrator == "preintegrated":
        pairs = memo(pair_table, function, pair_table_size, step_length)
        return {"pairs": pairs, "lookup": function.lookup(pair_table_size, level)}, {"INTEGRATOR": 2}
    given = _tabulated(function, table_size, level, memo)
    if integrator in POINTS:
        return given | gauss_points(POINTS[integrator]), {"INTEGRATOR": 3, "ORDER": POINTS[integrator]}
    return given, {"INTEGRATOR": INTEGRATORS.index(integrator)}


def _exactly(function, level):
    """The transfer function as its keys: (n, 4) colour and extinction, and (n, 1) values less ``level``."""
    if not function.keys:
        return {"keys": np.zeros((1, 4)), "places": np.zeros((1, 4))}
    colors = np.array([[*key.color, float(function.extinction(key.opacity))] for key in function.keys])
    values = np.array([[key.value - level, 0.0, 0.0, 0.0] for key in function.keys])
    return {"keys": colors, "places": values}


def leaps(ranges, function, what, rows, least, level):
    """How far a ray may leap from each brick; None where it is not worth asking."""
    visible = visible_groups(ranges, function, what, rows, least, level)
    return None if visible is None else bricks.Leaps.over(visible)


def visible_groups(ranges, function, what, rows, least, level):
    """The bricks, or groups of bricks, in which something can be seen; None where it is not worth asking."""
    values = ranges.data
    if what == "iso":
        visible = bricks.visible_above(values, least, level)
    elif what in ("cellwise", "adaptive"):
        visible = bricks.visible_by_keys(values, function, least)
    elif what == "preintegrated":
        visible = bricks.visible_bricks(values, *preintegration.pair_extinction(function, rows), least)
    else:
        threshold = np.nextafter(np.float32(least), np.float32(-1.0)) if what == "first_hit" else least
        visible = bricks.visible_bricks(values, function.table(rows), function.lookup(rows), threshold)
    return bricks.unless_most(visible)
