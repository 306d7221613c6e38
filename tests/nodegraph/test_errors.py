"""Messages of errors: one sentence, the place first, whatever a plug-in raises."""

from __future__ import annotations

import pytest

from nodegraph.errors import GraphError, ParameterError, ProcessError, ShaderError, near_miss


class Mute(Exception):
    def __str__(self) -> str:
        raise ValueError("this has no text")


@pytest.mark.parametrize(
    ("cause", "text"),
    [
        (ValueError("boom"), "blur: ValueError: boom"),
        (ValueError("several\n  lines"), "blur: ValueError: several lines"),
        (ValueError(), "blur: ValueError: no message"),
        (Mute(), "blur: Mute: no message"),
        (KeyError("blur.x"), "blur: KeyError: 'blur.x'"),
        (ParameterError("blur.sigma: too small"), "blur.sigma: too small"),
        (GraphError("blur: mend it"), "blur: mend it"),
        (GraphError("blurred: mend it"), "blur: blurred: mend it"),
    ],
)
def test_a_failed_processor_is_named_once(cause, text) -> None:
    assert str(ProcessError("blur", "process", cause)) == text


def test_the_line_in_the_processors_own_file_is_named() -> None:
    code = compile("\n\ndef process():\n    return 1 / 0\n", "/plugins/filter/blur.py", "exec")
    space: dict = {}
    exec(code, space)
    with pytest.raises(ZeroDivisionError) as caught:
        space["process"]()
    failed = ProcessError("blur", "process", caught.value, "/plugins/filter/blur.py")
    assert str(failed) == "blur: ZeroDivisionError: division by zero (blur.py, line 4)"
    assert "line" not in str(ProcessError("blur", "process", caught.value, "/plugins/filter/other.py"))


def test_needs_is_the_processors_own_fault_and_a_refused_input_is_not() -> None:
    assert ProcessError("blur", "process", ParameterError("blur.sigma: too small")).exit_code == 2
    assert ProcessError("blur", "needs", ParameterError("blur.sigma: too small")).exit_code == 1


def test_near_misses_do_not_tell_case() -> None:
    assert near_miss("PLAIN", ["ramp", "plain"]) == " (did you mean 'plain'?)"
    assert near_miss("gaussianblur", ["GaussianBlur"]) == " (did you mean 'GaussianBlur'?)"
    assert near_miss("x", ["plain"]) == ""


def test_the_excerpt_of_a_shader_is_short() -> None:
    assert len(str(ShaderError("nested too deep", file="a.glsl", line=7, excerpt="(" * 10_000))) < 300
