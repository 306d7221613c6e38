"""Finding kernel files, joining includes, and knowing where a line came from."""

# ruff: noqa: E501

from __future__ import annotations

from pathlib import Path

import pytest

from nodegraph import shaders
from nodegraph.compute import language
from nodegraph.errors import ShaderError


def write(folder: Path, name: str, text: str) -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def test_includes_are_joined_once_and_lines_keep_their_place(tmp_path: Path) -> None:
    own, built_in = tmp_path / "own", tmp_path / "built_in"
    write(built_in, "common/a.glsl", "float a(float x) { return x; }")
    write(built_in, "common/b.glsl", '#include "common/a.glsl"\n\nfloat b(float x) { return a(x) + 1; }')
    write(
        own,
        "render/ray.glsl",
        '// Rays.\n#include "common/b.glsl"\n#include "common/a.glsl" // again\nfloat pixel(ivec2 at) { return b(1.0); }\n',
    )
    source = shaders.load("render/ray", [own, built_in])
    assert source.files == ("render/ray.glsl", "common/b.glsl", "common/a.glsl")
    assert source.paths[1] == str(built_in / "common/b.glsl")
    assert source.text.count("float a(") == 1
    with pytest.raises(ShaderError, match=r"common/b.glsl:3: .*write 1\.0") as caught:
        language.compile(source)
    assert (caught.value.file, caught.value.line) == ("common/b.glsl", 3)


def test_the_first_root_wins_and_names_are_listed(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    write(one, "x/a.glsl", "1")
    write(two, "x/a.glsl", "2")
    write(two, "y/b.glsl", "3")
    assert shaders.find("x/a", [one, two]) == one / "x/a.glsl"
    assert shaders.find("x/a.glsl", [two, one]) == two / "x/a.glsl"
    assert shaders.find("z", [one, two]) is None
    assert shaders.names([one, two, tmp_path / "missing"]) == ["x/a", "y/b"]


def test_digest_follows_the_joined_text(tmp_path: Path) -> None:
    write(tmp_path, "a.glsl", '#include "b.glsl"\n1')
    write(tmp_path, "b.glsl", "2")
    before = shaders.load("a", [tmp_path]).digest
    assert shaders.load("a", [tmp_path]).digest == before
    write(tmp_path, "b.glsl", "3")
    assert shaders.load("a", [tmp_path]).digest != before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '#include "common/lihgt.glsl"',
            r"a.glsl:1: cannot find the include .* \(did you mean 'common/light.glsl'\?\)",
        ),
        ('\n#include "../secret.glsl"', "a.glsl:2: write #include"),
        ("#include <stdio.h>", "a.glsl:1: write #include"),
        ("#include common/light.glsl", "a.glsl:1: write #include"),
        ('#if 1\n#include "common/light.glsl"\n#endif', "a.glsl:2: #include inside #if"),
        ("/* open", "never closed"),
    ],
)
def test_bad_includes(tmp_path: Path, text: str, message: str) -> None:
    write(tmp_path, "a.glsl", text)
    write(tmp_path, "common/light.glsl", "")
    with pytest.raises(ShaderError, match=message):
        language.compile(shaders.load("a", [tmp_path]))


def test_missing_and_unreadable_files(tmp_path: Path) -> None:
    write(tmp_path, "render/raycast.glsl", "")
    with pytest.raises(
        ShaderError, match=r"render/raycats: there is no such shader file \(did you mean 'render/raycast'\?\)"
    ):
        shaders.load("render/raycats", [tmp_path])
    with pytest.raises(ShaderError, match="no name of a shader file"):
        shaders.load("../etc/passwd", [tmp_path])
    (tmp_path / "bytes.glsl").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ShaderError, match=r"bytes\.glsl: this shader file cannot be read as UTF-8"):
        shaders.load("bytes", [tmp_path])


def test_includes_in_comments_are_text(tmp_path: Path) -> None:
    write(
        tmp_path,
        "a.glsl",
        '/*\n#include "nowhere.glsl"\n*/\n// #include "nowhere.glsl"\nfloat pixel(ivec2 at) { return 1.0; }',
    )
    assert language.compile(shaders.load("a", [tmp_path])).entry == "pixel"


def test_a_text_is_a_source_too() -> None:
    source = shaders.Source.of("a\nb", "mine.glsl")
    assert source.place(2) == ("mine.glsl", 2)
    assert str(source.error(2, "wrong")) == "mine.glsl:2: wrong\n    b"
