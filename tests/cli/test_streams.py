"""The streams of a command and its end: answers alone on the standard output, and nothing left behind by a signal."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nodegraph.cli import terminal

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "nodegraph"]

TALKATIVE = '''
"""Prints."""
import os
from nodegraph import Output, Processor
from nodegraph.data import Image
import numpy as np

print("said while it was imported")

class Talkative(Processor):
    """Prints as Python does, and as a C library does."""

    image = Output(Image, doc="Black.")

    def process(self):
        print("said by Python")
        os.write(1, b"said by C\\n")
        return Image(np.zeros((2, 2, 4), np.float32))
'''

LASTING = '''
"""Lasts."""
import os, time
from nodegraph import File, Float, Output, Processor
from nodegraph.data import Image
from nodegraph.formats import replacing

class Lasting(Processor):
    """Begins to write a file, says who it is, and does not come to an end."""

    image = Output(Image, doc="Never.")
    mark = File(write=True, doc="Where its process number goes.")
    number = Float(0.0, doc="Of no effect.")

    def process(self, mark, number):
        with replacing(mark + ".large"):
            with open(mark + ".new", "w") as file:
                file.write(str(os.getpid()))
            os.rename(mark + ".new", mark)
            time.sleep(60)
'''


@pytest.fixture
def own_plugins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "own plugins" / "trial"
    folder.mkdir(parents=True)
    (folder / "talkative.py").write_text(TALKATIVE)
    (folder / "lasting.py").write_text(LASTING)
    monkeypatch.setenv("NODEGRAPH_PATH", str(folder.parent))


def shell(redirection: str, *arguments: object, **environment: str) -> subprocess.CompletedProcess[bytes]:
    command = ["sh", "-c", f'exec "$@" {redirection}', "sh", *COMMAND, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, env=os.environ | environment)


def test_what_plugins_print_is_no_part_of_the_answer(workspace, own_plugins, tmp_path) -> None:
    file = workspace(picture={"type": "trial.talkative", "version": 1})
    done = shell("", "run", file, "--json", "--out", tmp_path / "out")
    assert json.loads(done.stdout)["files"] == [str(tmp_path / "out" / "view.png")]
    for said in (b"said while it was imported", b"said by Python", b"said by C"):
        assert said in done.stderr


@pytest.mark.parametrize("redirection", [">&-", "2>&-", ">&- 2>&-"])
def test_a_closed_stream_is_one_that_nobody_reads(workspace, plugins, tmp_path, redirection) -> None:
    done = shell(redirection, "run", workspace(), "--out", tmp_path / "out")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout in (b"", f"{tmp_path / 'out' / 'view.png'}\n".encode())
    assert shell(redirection, "run", "nowhere.json").stdout == b""


def test_a_full_standard_output_is_named(plugins) -> None:
    done = shell("> /dev/full", "list", "--json")
    assert (done.returncode, done.stderr) == (2, b"nodegraph: standard output: no space left on device\n")


def test_names_that_a_terminal_cannot_show_are_escaped(workspace, plugins, tmp_path) -> None:
    done = shell("", "run", workspace(), "--out", tmp_path / "b\xfc", PYTHONIOENCODING="ascii")
    assert done.returncode == 0
    assert done.stdout.endswith(rb"b\xfc/view.png" + b"\n")
    assert (tmp_path / "b\xfc" / "view.png").is_file()


@pytest.mark.parametrize(
    "arguments", [("run", "nowhere.json"), ("run", "a.json", "--size", "x"), ("info", "nowhere.nii"), ("list", "--bad")]
)
def test_with_json_a_mistake_is_a_document_too(cli, arguments) -> None:
    ran = cli(*arguments, "--json")
    assert ran.code == 2
    assert ran.json["ok"] is False
    assert ran.json["exit_code"] == 2
    assert ran.err == f"nodegraph: {ran.json['error']}\n"


def test_outside_a_command_an_answer_is_printed(capsys) -> None:
    terminal.answer("yes")
    assert capsys.readouterr().out == "yes\n"


def test_the_streams_are_as_before_after_a_command() -> None:
    before = sys.stdout, sys.stderr
    with terminal.own_output():
        assert sys.stdout is sys.stderr
    assert (sys.stdout, sys.stderr) == before


@pytest.mark.parametrize(("number", "code"), [(signal.SIGKILL, -9), (signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_command_that_is_ended_leaves_no_worker_and_no_half_file(
    workspace, own_plugins, tmp_path, number, code
) -> None:
    mark = tmp_path / "mark"
    file = workspace(picture={"type": "trial.lasting", "version": 1, "params": {"mark": str(mark)}})
    arguments = ["sweep", str(file), "--vary", "picture.number=1,2", "--workers", "1", "--out", str(tmp_path / "out")]
    with subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        wait_for(mark.exists)
        worker = int(mark.read_text())
        process.send_signal(number)
    assert process.returncode == code
    wait_for(lambda: ended(worker))
    assert [path.name for path in tmp_path.iterdir() if "part" in path.name] == []


def wait_for(condition) -> None:
    end = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def ended(number: int) -> bool:
    """Whether a process is no more, or waits only to be asked how it ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True
