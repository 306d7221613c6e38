"""The page of the kernel language is true: its example runs, its lists are complete, its refusals are refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph import shaders
from nodegraph.compute import language
from nodegraph.compute.language import builtins
from nodegraph.errors import ShaderError


@pytest.fixture(scope="module")
def page(root: Path) -> str:
    return (root / "docs" / "kernel-language.md").read_text("utf-8")


def test_the_example_runs_on_every_device(page: str, device: Any, tmp_path: Path, rng: np.random.Generator) -> None:
    kernel, common = re.findall(r"```glsl\n(.*?)```", page, re.DOTALL)
    (tmp_path / "filter").mkdir()
    (tmp_path / "common").mkdir()
    (tmp_path / "filter" / "smooth_axis.glsl").write_text(kernel)
    (tmp_path / "common" / "axis.glsl").write_text(common)
    source = shaders.load("filter/smooth_axis", [tmp_path])
    volume = rng.normal(size=(3, 4, 6)).astype(np.float32)
    got = device.run(source, (6, 4, 3), volume=volume, sigma=2.0, axis=1, threshold=0.5, defines={"RADIUS": 1})

    weight = np.exp(-0.5 / 4)
    padded = np.pad(volume.astype(np.float64), ((0, 0), (1, 1), (0, 0)), mode="edge")
    mean = (padded[:, 1:-1] + weight * (padded[:, :-2] + padded[:, 2:])) / (1 + 2 * weight)
    np.testing.assert_allclose(got.smoothed.array, mean, rtol=1e-5, atol=1e-6)
    np.testing.assert_array_equal(got.steep.array, np.abs(padded[:, 2:] - padded[:, :-2]) > 1.0)

    module = language.compile(source)
    assert [(uniform.name, uniform.doc) for uniform in module.uniforms[:2]] == [
        ("sigma", "0.1..10 voxel; Standard deviation."),
        ("axis", "0..2; Axis: x, y or z."),
    ]


def test_every_builtin_is_on_the_page(page: str) -> None:
    words = set(re.findall(r"\w+", page))
    assert sorted(builtins.NAMES - words) == []


@pytest.mark.parametrize(
    "body",
    [
        "float x = 1;",
        "float x = max(1.0, 0);",
        "discard;",
        "bool b = vec2(0.0) == vec2(1.0);",
        "bool b = vec2(0.0) < vec2(1.0);",
        "vec3 v = mat3(1.0) * vec3(1.0);",
        "vec2 p = gl_FragCoord.xy;",
        "float x = dFdx(1.0);",
        "switch (1) {}",
        "barrier();",
        "float a__b = 1.0;",
    ],
)
def test_what_the_page_says_is_refused_is_refused(body: str) -> None:
    with pytest.raises(ShaderError, match=r"kernel\.glsl:1: "):
        language.compile(f"float pixel(ivec2 at) {{ {body} return 1.0; }}")
