"""Files stand where a reader looks for them, and the repository names no machine and no person's folder."""

from __future__ import annotations

import ast
import re
import subprocess
from pathlib import Path

import pytest

from nodegraph import registry

ROOT = Path(__file__).resolve().parents[2]
PROCESSORS = sorted((ROOT / "processors").rglob("*.py")) + sorted((ROOT / "processors").rglob("*.glsl"))
LONGEST = 500

#: Home folders, mount points of one machine, and hosts that a build must not depend on.
LOCAL = re.compile(r"(?<![\w.$)}])/(?:work|farm|root|home/\w+|Users/\w+)/|/tmp/w\b|pypi\.org|files\.pythonhosted")


def tracked() -> list[Path]:
    """The files of the repository, with those that are new and not ignored."""
    command = ["git", "-c", "safe.directory=*", "ls-files", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in done.stdout.splitlines() if (ROOT / name).is_file()]


def id_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT / "processors").with_suffix("").parts)


@pytest.mark.parametrize("path", PROCESSORS, ids=id_of)
def test_processor_has_its_page_and_its_test(path: Path) -> None:
    id = id_of(path)
    category = id.rpartition(".")[0].replace(".", "/")
    assert (ROOT / "docs" / "processors" / f"{id}.md").is_file(), f"{id} has no page: run nodegraph docs"
    tests = sorted((ROOT / "tests" / "processors" / category).glob("test_*.py"))
    tested = any(path.stem == test.stem.removeprefix("test_") or id in test.read_text("utf-8") for test in tests)
    assert tested, f"{id} has no test in tests/processors/{category}"


@pytest.mark.parametrize("path", [path for path in PROCESSORS if path.suffix == ".py"], ids=id_of)
def test_processor_imports_no_other_processor_and_no_device(path: Path) -> None:
    forbidden = {"moderngl", "pyopencl", "PySide6", "processors"}
    tree = ast.parse(path.read_text("utf-8"))
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    relative = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level]
    assert not relative, "a processor is loaded by path and has no package around it"
    assert not {name.partition(".")[0] for name in names} & forbidden
    assert not [name for name in names if name.startswith("nodegraph.processors")]


def test_every_kernel_belongs_to_a_processor() -> None:
    used = {name for entry in registry.catalogue() for name in entry.get("kernels", ())}
    files = {
        path.relative_to(ROOT / "shaders").with_suffix("").as_posix() for path in (ROOT / "shaders").rglob("*.glsl")
    }
    assert {name for name in files if not name.startswith("common/")} <= used
    assert used <= files | {id_of(path).replace(".", "/") for path in PROCESSORS}


def test_every_built_in_processor_can_be_loaded() -> None:
    assert {entry["id"]: entry["unavailable"] for entry in registry.catalogue() if "unavailable" in entry} == {}


def test_no_file_names_a_place_of_one_machine() -> None:
    found = []
    for path in tracked():
        content = path.read_bytes()
        if path == Path(__file__).resolve() or b"\0" in content:
            continue
        for number, line in enumerate(content.decode("utf-8", "replace").splitlines(), 1):
            if LOCAL.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert found == []


def test_files_are_short() -> None:
    sources = [path for path in tracked() if path.suffix in (".py", ".glsl") and "tests" not in path.parts]
    lengths = {str(path.relative_to(ROOT)): path.read_text("utf-8").count("\n") for path in sources}
    assert {name: lines for name, lines in lengths.items() if lines > LONGEST} == {}


def test_ci_runs_what_the_readme_says_and_nothing_else() -> None:
    commands = [
        line.strip()
        for line in (ROOT / ".ci" / "run").read_text("utf-8").splitlines()
        if line.strip() and not line.startswith("#")
    ]
    assert commands == ["set -euo pipefail", 'cd "$(dirname "$0")/.."', "exec make test"]
    readme = (ROOT / "README.md").read_text("utf-8")
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in ("demo", "test"):
        assert f"make {target}" in readme
        assert re.search(rf"^{target}:", makefile, re.MULTILINE)


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text("utf-8"))
    broken = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert broken == []
