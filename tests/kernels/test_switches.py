"""Switches of a kernel: which a variant holds, which it leaves out, which of them make no difference to it."""

from __future__ import annotations

import pytest

from nodegraph import locations, shaders
from nodegraph.compute.language import switches
from nodegraph.compute.language.switches import _declared
from nodegraph.errors import ShaderError
from nodegraph.shaders import Source

TEXT = """
#ifndef MODE
#define MODE 0          // 0 plain, 1 doubled; 3 tripled, in red
#endif
#ifndef LIT
#define LIT 0           // Phong illumination
#endif
#ifndef GRADIENT
#define GRADIENT 0      // 1: a volume of gradients is bound; 0: differences on the fly
#endif
#ifndef CUT
#define CUT false       // 1: half of it is cut away
#endif
#ifndef SHARE
#define SHARE 0.5       // what is left
#endif
#ifndef OTHER
#define ANOTHER 1
#endif
field2 image;
#if GRADIENT
field2 slope;
#endif
vec4 shade(vec4 color, ivec2 at) {
#if LIT
#if GRADIENT
    return color * fetch2(slope, at).x;
#else
    return color * fetch2(image, at + 1).x;
#endif
#else
    return color;
#endif
}
vec4 pixel(ivec2 at) {
    float factor = float(MODE + 1);
    return shade(SHARE * factor * fetch2(image, CUT ? at / 2 : at), at);
}
"""


def told(**defines):
    return {switch.name: switch for switch in switches(Source.of(TEXT, "trial.glsl"), defines)}


def test_values_come_from_the_host_and_else_from_the_file() -> None:
    plain = told()
    assert list(plain) == ["MODE", "LIT", "GRADIENT", "CUT", "SHARE"]
    assert [switch.value for switch in plain.values()] == [0, 0, 0, False, 0.5]
    assert told(MODE=3, CUT=True)["MODE"].value == 3
    assert told(MODE=3, CUT=True)["CUT"].value is True
    assert plain["LIT"].file == "trial.glsl"


def test_a_comment_tells_single_values_or_the_whole() -> None:
    assert str(told()["MODE"]) == "MODE 0: plain"
    assert str(told(MODE=1)["MODE"]) == "MODE 1: doubled"
    assert str(told(MODE=3)["MODE"]) == "MODE 3: tripled, in red"
    assert str(told(LIT=True)["LIT"]) == "LIT 1: Phong illumination"
    assert str(told(LIT=True, GRADIENT=True)["GRADIENT"]) == "GRADIENT 1: a volume of gradients is bound"
    assert str(told(SHARE=0.25)["SHARE"]) == "SHARE 0.25: what is left"


def test_a_feature_is_held_left_out_or_without_effect() -> None:
    unlit, lit = told(), told(LIT=True)
    assert unlit["MODE"].held, "0 is one of its choices"
    assert not unlit["LIT"].held
    assert unlit["LIT"].matters
    assert lit["LIT"].held
    assert not unlit["GRADIENT"].matters, "without light nobody asks for gradients"
    assert not unlit["GRADIENT"].held
    assert lit["GRADIENT"].held, "its 0 is a choice: on the fly"
    assert not lit["CUT"].held
    assert lit["CUT"].meaning == "half of it is cut away"


def test_a_value_that_the_kernel_refuses_matters() -> None:
    text = (
        "#ifndef A\n#define A 1  // 1 one\n#endif\n#if A == 0\n#error no\n#endif\nfloat pixel(ivec2 at) { return 1.0; }"
    )
    (switch,) = switches(Source.of(text))
    assert switch.matters
    with pytest.raises(ShaderError, match="refused"):
        switches(Source.of(text), {"A": 0})


KERNELS = [name for name in shaders.names([locations.shaders()]) if not name.startswith("common/")]


@pytest.mark.parametrize("name", KERNELS)
def test_switches_of_shipped_kernels_are_documented(name) -> None:
    """A switch without a comment could not be explained. Whether it matters, for which it is compiled, is not asked."""
    source = shaders.load(name, [locations.shaders()])
    for line, switch, _, doc in _declared(source):
        assert doc, f"{source.place(line)[0]}: say behind #define what {switch} stands for"
