"""What a processor class may declare, and what happens at the moment it is made."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np
import pytest

from nodegraph import Bool, Choice, Float, Input, Int, Output, Processor, has_components
from nodegraph.data import Image, Volume
from nodegraph.errors import ParameterError, PortError
from nodegraph.processor import bind
from nodegraph.signature import camel, snake

VOLUME = Volume(np.zeros((2, 3, 4), "f4"))
IMAGE = Image(np.zeros((2, 3, 4), "f4"))


class GaussianBlur(Processor):
    """Replace every voxel by the weighted mean of its surroundings.

    The width is physical.
    """

    volume = Input(Volume, doc="Scalar field.", accepts=has_components(1))
    mask = Input(Volume, doc="Where.", required=False)
    smoothed = Output(Volume, doc="Same grid.")
    sigma = Float(1.0, min=0.0, unit="mm", doc="Standard deviation.")
    order = Int(0, min=0, max=2, doc="Derivative.")

    def process(self, volume: Any, mask: Any, sigma: Any, order: Any, *, memo: Any, progress: Any) -> Any:
        return volume


class Shading(Processor):
    """Three parameters that depend on each other in a row."""

    image = Output(Image, doc="Picture.")
    depth = Output(Image, doc="Depth.")
    mode = Choice("composite", "maximum", doc="Mode.")
    lit = Bool(True, visible_if={"mode": "composite"}, doc="Light.")
    shininess = Float(20.0, visible_if={"lit": True}, doc="Gloss.")

    def process(self, mode: Any, lit: Any, shininess: Any, *, wanted: Any) -> Any:
        yield self.Outputs(image=IMAGE)


def declare(members: dict[str, Any], name: str = "Thing", parent: type = Processor, **keywords: Any) -> Any:
    return type(name, (parent,), {"__module__": __name__, **members}, **keywords)


def test_declarations_are_collected_in_order() -> None:
    assert list(GaussianBlur.inputs) == ["volume", "mask"]
    assert list(GaussianBlur.outputs) == ["smoothed"]
    assert list(GaussianBlur.params) == ["sigma", "order"]
    assert GaussianBlur.services == ("memo", "progress")
    assert GaussianBlur.id == "gaussian_blur"
    assert GaussianBlur.sigma.name == "sigma"
    assert not GaussianBlur.generator
    assert Shading.generator


def test_inherited_declarations_come_first_and_may_be_overridden() -> None:
    class Wide(GaussianBlur):
        """Wider."""

        border = Bool(False, doc="Border.")
        sigma = Float(5.0, min=1.0, doc="Wider.")

        def process(self, volume: Any, mask: Any, sigma: Any, order: Any, border: Any) -> Any:
            return volume

    assert list(Wide.params) == ["sigma", "order", "border"]
    assert Wide.params["sigma"].default == 5.0
    assert GaussianBlur.params["sigma"].default == 1.0
    assert list(Wide.inputs) == ["volume", "mask"]
    assert Wide.services == ()


def test_an_abstract_class_only_carries_declarations() -> None:
    class Lit(Processor, abstract=True):
        ambient = Float(0.1, doc="Light from all around.")

    class Dark(Lit):
        """Dark."""

        image = Output(Image, doc="Picture.")

        def process(self, ambient: Any) -> Any:
            return IMAGE

    assert list(Dark.params) == ["ambient"]
    assert Lit.abstract
    assert not Dark.abstract


def test_a_processor_holds_no_state() -> None:
    thing = GaussianBlur()
    for name in ("sigma", "volume", "smoothed", "cache", "id"):
        with pytest.raises(AttributeError, match=f"GaussianBlur.{name}: "):
            setattr(thing, name, 1)
    with pytest.raises(AttributeError, match="take the value as an argument of process"):
        _ = thing.sigma
    with pytest.raises(AttributeError, match="arguments of process"):
        _ = thing.volume
    for name in ("__init__", "__new__", "__setattr__"):
        with pytest.raises(TypeError, match=f"Thing.{name}: a processor is a function of what it declares"):
            declare({name: lambda self: None, "image": Output(Image, doc="p"), "process": lambda self: None})


def process_of(text: str) -> Any:
    """A function from its text, so that bad signatures can be listed in a table."""
    scope: dict[str, Any] = {}
    exec(text, scope)
    return scope["process"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def process(self, volume): pass", "the parameter sigma is declared but process"),
        ("def process(self, sigma): pass", "the input volume is declared but process"),
        ("def process(self, volume, sigmo): pass", r"sigmo is no declared input or parameter \(did you mean 'sigma'"),
        ("def process(self, volume, sigma, result): pass", "result is an output; return it"),
        ("def process(self, volume, sigma, size): pass", "size comes from outside; put it after a *"),
        ("def process(self, volume, *, sigma): pass", "sigma is declared; put it before the *"),
        ("def process(self, volume, sigma, *, devise): pass", r"devise is no service \(did you mean 'device'"),
        ("def process(self, volume, sigma=1): pass", "arguments have no defaults here"),
        ("def process(self, *args): pass", "name every argument"),
        ("def process(self, volume, sigma, **rest): pass", "name every argument"),
        ("def process(): pass", "the first argument is self"),
        ("async def process(self, volume, sigma): pass", "must not be async"),
        ("process = 3", "must be a plain method"),
        ("process = None", "define process"),
    ],
)
def test_signatures_that_do_not_fit(text: str, message: str) -> None:
    members = {"volume": Input(Volume, doc="v"), "result": Output(Volume, doc="r"), "sigma": Float(1.0, doc="s")}
    with pytest.raises(TypeError, match=f"^Thing.process: {message}"):
        declare({**members, "process": process_of(text)})


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"sigma": Float(1.0)}, "Thing.sigma: say what it is, with doc="),
        ({"volume": Input(Volume)}, "Thing.volume: say what it is"),
        ({"sigma": Float}, r"Thing.sigma: declare an object, Float\(...\)"),
        ({"id": Float(1.0, doc="s")}, "Thing.id: this name is reserved"),
        ({"_sigma": Float(1.0, doc="s")}, "Thing._sigma: this name is reserved"),
        ({"a": Float(1.0, doc="s", visible_if={"b": 1})}, "Thing.a: visible_if names 'b', no parameter"),
        (
            {"mode": Choice("x", "y", doc="m"), "a": Float(1.0, doc="s", visible_if={"mode": ("x", "z")})},
            "Thing.a: visible_if mode: 'z' is none of x, y",
        ),
        (
            {"a": Bool(True, doc="s", visible_if={"b": True}), "b": Bool(True, doc="s", visible_if={"a": True})},
            "Thing.a: visible_if goes in a circle: a -> b -> a",
        ),
        ({"formerly": "filter.gauss"}, "Thing.formerly: give a tuple"),
        ({"kernels": "filter/gauss"}, "Thing.kernels: give a tuple"),
        ({"version": 0}, "Thing.version: give a whole number"),
        ({"effect": 1}, "Thing.effect: give True or False"),
        ({"effect": True, "disk_cache": True}, "Thing: an effect is never cached"),
        ({"needs": lambda self, size: {}}, r"Thing.needs: takes \(self, size, quality, wanted, params\), not \(size\)"),
        ({"migrate": lambda self, params, version: {}}, "Thing.migrate: write it as @staticmethod"),
        ({"migrate": staticmethod(lambda params: {})}, "Thing.migrate: write it as @staticmethod"),
    ],
)
def test_declarations_that_do_not_fit(members: dict[str, Any], message: str) -> None:
    with pytest.raises(TypeError, match=f"^{message}"):
        declare({"image": Output(Image, doc="p"), "process": lambda self: None, **members})


def test_nothing_declared() -> None:
    with pytest.raises(TypeError, match=r"^Thing: nothing is declared"):
        declare({"process": lambda self: None})


def test_a_declaration_cannot_be_hidden_or_change_sort() -> None:
    with pytest.raises(TypeError, match=r"Thing.sigma: this hides a declared port or parameter"):
        declare({"sigma": 3.0}, parent=GaussianBlur)
    with pytest.raises(TypeError, match=r"Thing.sigma: an ancestor declares this name as something else"):
        declare({"sigma": Input(Volume, doc="v")}, parent=GaussianBlur)


def test_visibility_follows_effective_values() -> None:
    assert Shading.visible({}) == ("mode", "lit", "shininess")
    assert Shading.visible({"lit": False}) == ("mode", "lit")
    # Not lit in this mode whatever the value says; a hidden switch counts as its default.
    assert Shading.visible({"mode": "maximum", "lit": False}) == ("mode", "shininess")
    assert Shading.effective({"mode": "maximum", "lit": False, "shininess": 5.0}) == {
        "mode": "maximum",
        "lit": True,
        "shininess": 5.0,
    }
    assert Shading.effective({"lit": False, "shininess": 5.0})["shininess"] == 20.0
    assert GaussianBlur.visible({}) == ("sigma", "order")


def test_pack_one_output() -> None:
    assert GaussianBlur.pack(VOLUME) == {"smoothed": VOLUME}
    with pytest.raises(PortError, match=r"^blur\.smoothed: expected a Volume, got an Image$"):
        GaussianBlur.pack(IMAGE, where="blur")
    with pytest.raises(PortError, match=r"^gaussian_blur\.smoothed: process\(\) returned nothing"):
        GaussianBlur.pack(None)


def test_pack_several_outputs() -> None:
    both = Shading.Outputs(IMAGE, IMAGE)
    assert Shading.pack(both) == {"image": IMAGE, "depth": IMAGE}
    only = Shading.Outputs(image=IMAGE)
    assert Shading.pack(only, wanted=frozenset({"image"})) == {"image": IMAGE}
    with pytest.raises(PortError, match=r"^shading\.depth: process\(\) returned nothing"):
        Shading.pack(only)
    with pytest.raises(PortError, match=r"must return self.Outputs\(image=..., depth=...\)"):
        Shading.pack(IMAGE)


def test_pack_names_undeclared_outputs() -> None:
    class Wrong(NamedTuple):
        image: Any
        dept: Any

    with pytest.raises(PortError, match=r"^shading\.dept: .* \(did you mean 'depth'\?\)"):
        Shading.pack(Wrong(IMAGE, IMAGE))


def test_pack_of_an_effect() -> None:
    class Save(Processor):
        """Write."""

        effect = True
        image = Input(Image, doc="Picture.")

        def process(self, image: Any) -> None:
            return None

    assert Save.pack(None) == {}
    with pytest.raises(PortError, match="no output is declared"):
        Save.pack(IMAGE)


def test_bind_checks_names_values_and_conditions() -> None:
    inputs, params = bind(GaussianBlur, {"volume": VOLUME, "sigma": 2})
    assert inputs == {"volume": VOLUME, "mask": None}
    assert params == {"sigma": 2.0, "order": 0}
    with pytest.raises(ParameterError, match=r"^gaussian_blur\.sigm: .* \(did you mean 'sigma'"):
        bind(GaussianBlur, {"volume": VOLUME, "sigm": 2})
    with pytest.raises(ParameterError, match=r"^gaussian_blur\.sigma: -1\.0 mm is below 0\.0 mm"):
        bind(GaussianBlur, {"volume": VOLUME, "sigma": -1})
    with pytest.raises(PortError, match=r"^gaussian_blur\.volume: nothing is connected"):
        bind(GaussianBlur, {})


def test_bind_makes_values_of_arrays() -> None:
    array = np.arange(24, dtype="i2").reshape(2, 3, 4)
    volume = bind(GaussianBlur, {"volume": array}).inputs["volume"]
    assert isinstance(volume, Volume)
    assert volume.dims == (4, 3, 2)
    assert np.shares_memory(volume.data, array)


def test_describe_is_json() -> None:
    told = json.loads(json.dumps(GaussianBlur.describe(), allow_nan=False))
    assert told["name"] == "GaussianBlur"
    assert told["doc"].startswith("Replace every voxel")
    assert list(told["inputs"]) == ["volume", "mask"]
    assert told["params"]["sigma"]["unit"] == "mm"
    assert "effect" not in told


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("GaussianBlur", "gaussian_blur"),
        ("View", "view"),
        ("RGBToHSV", "rgb_to_hsv"),
        ("DVRFast", "dvr_fast"),
        ("ProxyBox", "proxy_box"),
        ("Slice3D", "slice3d"),
    ],
)
def test_names(name: str, stem: str) -> None:
    assert snake(name) == stem
    assert camel(stem).lower() == name.lower()


def test_only_an_effect_may_ask_for_the_workspace() -> None:
    with pytest.raises(TypeError, match="only an effect may ask for the workspace; set effect = True"):

        class Nosy(Processor):
            """Reads what no fingerprint holds."""

            text = Output(str, doc="The workspace.")

            def process(self, *, workspace):
                return workspace("a.json")
