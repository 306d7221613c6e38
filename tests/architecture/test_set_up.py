"""What `make` does before anything else: find a Python, make an environment, mend one that is broken."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    settings = {name: value for name, value in os.environ.items() if name not in ("PYTHON", "VENV", "MAKEFLAGS")}
    return subprocess.run(
        command,
        cwd=ROOT,
        env=settings | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def set_up(**environment: str) -> subprocess.CompletedProcess[str]:
    return run("sh", "scripts/set_up.sh", "demo", **environment)


def old_python(path: Path) -> Path:
    path.write_text("#!/bin/sh\nexit 1\n")
    path.chmod(0o755)
    return path


def test_a_python_that_is_named_and_too_old_is_refused(tmp_path: Path) -> None:
    python = old_python(tmp_path / "python3.9")
    done = set_up(PYTHON=str(python), VENV=str(tmp_path / "venv"))
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(f"set-up: PYTHON={python} is no Python of 3.11 or newer")
    assert not (tmp_path / "venv").exists()


def test_where_every_python_is_too_old_the_cure_is_named(tmp_path: Path) -> None:
    for name in ("python", "python3", *(f"python3.{minor}" for minor in range(11, 15))):
        old_python(tmp_path / name)
    done = set_up(PATH=f"{tmp_path}{os.pathsep}{os.environ['PATH']}", VENV=str(tmp_path / "venv"))
    assert done.returncode == 1
    assert done.stderr.endswith("install one, or name it: make demo PYTHON=/path/to/python3\n")


def test_a_folder_that_is_no_environment_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    done = set_up(VENV=str(tmp_path))
    assert done.returncode == 1
    assert "no virtual environment: name another folder" in done.stderr
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_make_runs_the_python_of_the_environment_whatever_it_was_made_with() -> None:
    done = run(
        "make", "--dry-run", "--no-print-directory", "demo", "PYTHON=python3.99", "VENV=my env", "OUT=my pictures"
    )
    assert '"my env/bin/python" -m nodegraph run' in done.stdout
    assert "python3.99 -m" not in done.stdout
    assert "my pictures/" in done.stdout


@pytest.mark.slow
def test_an_environment_is_kept_while_it_is_sound_and_made_anew_when_it_is_not(tmp_path: Path) -> None:
    folder = tmp_path / "my env"
    venv.create(folder, with_pip=False)
    pip = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)})) / "pip"
    maker = tmp_path / "python3"  # makes no environment, so that this test sees when one would be made
    maker.write_text(f'#!/bin/sh\n[ "$1" != -m ] || exit 7\nexec "{sys.executable}" "$@"\n')
    maker.chmod(0o755)

    def is_made_anew(folder: Path = folder) -> bool:
        done = set_up(VENV=str(folder), PYTHON=str(maker))
        assert done.returncode == (7 if f"making {folder} with" in done.stderr else 1), done.stderr
        return done.returncode == 7

    assert is_made_anew(), "its making was interrupted before pip came"
    pip.mkdir()
    (pip / "__init__.py").touch()
    (pip / "__main__.py").write_text("raise SystemExit('offline')")
    done = set_up(VENV=str(folder), PYTHON=str(maker))
    assert done.returncode == 1
    assert "offline\nset-up: pip could not install the packages" in done.stderr
    assert not is_made_anew(), "nothing but packages is missing"
    moved = folder.rename(tmp_path / "moved")
    assert is_made_anew(moved), "its scripts name the old place"
    moved.rename(folder)
    assert not is_made_anew()
    (folder / "bin" / "python").unlink()
    (folder / "bin" / "python").symlink_to(tmp_path / "gone")
    assert is_made_anew(), "its Python went away"
