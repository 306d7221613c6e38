"""How wrong a result is, and what accuracy costs.

    found = accuracy.reference(network, "view")       # double precision, refined until it no longer changes
    accuracy.errors(image, found.value, found.mask)   # max, rmse, psnr, 99.9 percentile
    accuracy.measure(network, "view", variants)       # time and error of settings, the front marked
    accuracy.tune(network, "view", max_error=0.004)   # the cheapest settings under an error

`settings` finds what can be traded in a network. docs/accuracy.md explains all of it.
"""

# The functions hide the modules of their names here; `from nodegraph.accuracy.reference import ...` still finds those.
from nodegraph.accuracy.measure import measure
from nodegraph.accuracy.measures import errors
from nodegraph.accuracy.reference import Reference, reference
from nodegraph.accuracy.settings import Knob, applied, quality_parameters, variants
from nodegraph.accuracy.tune import Tuned, tune

__all__ = [
    "Knob",
    "Reference",
    "Tuned",
    "applied",
    "errors",
    "measure",
    "quality_parameters",
    "reference",
    "tune",
    "variants",
]
