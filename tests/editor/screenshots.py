"""Pictures of the real window: ``python -m tests.editor.screenshots [SCENE ...] [--out FOLDER]``.

On the screen where there is one, else on a virtual one (Xvfb), else on Qt's offscreen platform. Nothing is compared:
somebody looks at them. docs/images holds some (made with ``--docs``).
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
SIZE, SMALL = (1440, 900), (1400, 860)


@contextmanager
def screen() -> Iterator[str]:
    """Choose Qt's platform, starting a virtual screen where it needs one. Yields its name."""
    if os.environ.get("QT_QPA_PLATFORM") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        yield os.environ.get("QT_QPA_PLATFORM", "")
        return
    program = shutil.which("Xvfb")
    if program is None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        yield "offscreen"
        return
    read, write = os.pipe()
    command = [program, "-displayfd", str(write), "-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            os.environ["DISPLAY"] = f":{told.readline().strip()}"
        os.environ["QT_QPA_PLATFORM"] = "xcb"
        yield "xcb"
    finally:
        server.terminate()
        server.wait()


class Shots:
    """A window that is led through scenes, each of which is one picture."""

    def __init__(self, folder: Path, small: bool) -> None:
        from PySide6.QtWidgets import QApplication

        from nodegraph.editor.app import application, open_window

        self.folder, self.small = folder, small
        self.app: QApplication = application()
        self.window = open_window()
        self.window.resize(*(SMALL if small else SIZE))
        self.window.move(0, 0)

    def wait(self, seconds: float = 0.3) -> None:
        """Let the window live for a while, and until every view shows its final picture."""
        end, patience = time.monotonic() + seconds, time.monotonic() + 90
        while time.monotonic() < end or (self.busy() and time.monotonic() < patience):
            self.app.processEvents()
            time.sleep(0.005)

    def busy(self) -> bool:
        return not self.window.session._channels.at_rest

    def theme(self, name: str) -> None:
        from nodegraph.editor import theme

        theme.apply(self.app, name)
        self.wait(0.2)

    def open(self, name: str) -> None:
        """Open a shipped workspace."""
        self.window._leaving = False
        self.window._open(ROOT / "workspaces" / name)
        self.window.reset_layout()
        self.wait(1.5)
        self.window.canvas.fit()
        self.wait(0.5)

    def take(self, name: str) -> None:
        """Write the picture of what is seen now."""
        from PySide6.QtGui import QImage

        self.wait(0.3)
        if self.app.platformName() == "xcb":
            picture = self.window.screen().grabWindow(0, 0, 0, self.window.width(), self.window.height())
        else:
            picture = self.window.grab()
        image = picture.toImage().convertToFormat(QImage.Format.Format_RGBX8888)
        if self.small:  # 64 steps of each colour look the same and pack better
            pixels = np.frombuffer(image.bits(), np.uint8)
            pixels[:] = (pixels // 4).astype(np.uint16) * 255 // 63
        file = self.folder / f"{name}.png"
        image.save(str(file), "PNG", 0)  # as small as it gets
        print(f"{file}: {file.stat().st_size // 1000} KB")

    def close(self) -> None:
        self.window._leaving = True
        self.window.close()
        self.app.processEvents()


def welcome(shots: Shots) -> None:
    shots.window.show_welcome()
    end = time.monotonic() + 60
    while time.monotonic() < end and any(card._picture is None for card in shots.window.welcome.cards):
        shots.wait(0.2)
    shots.take("welcome")


def gallery(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.session.select("rays")
    shots.take("gallery")


def transfer_function(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.session.select("raycast")
    shots.wait(1.0)
    shots.take("transfer_function")


def failed(shots: Shots) -> None:
    from nodegraph.commands import Set

    shots.open("brain.json")
    shots.window.session.do(Set("mri.path", "data/lost.nii.gz"))
    shots.window.session.select("mri")
    shots.wait(1.0)
    shots.take("failed_node")
    shots.window.session.undo()


def quad(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.quad_view()
    shots.wait(2.0)
    shots.take("quad_view")


def commands(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.open_commands()
    shots.window.commands.field.setText("view")
    shots.take("commands")
    shots.window.commands.close_it()


def timeline(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.docks["timeline"].raise_()
    shots.window.session.select("rays")
    shots.take("timeline")


def compare(shots: Shots) -> None:
    shots.open("brain.json")
    shots.window.docks["compare"].raise_()
    shots.wait(1.0)
    shots.take("compare")


def panels(shots: Shots) -> None:
    """Every panel below, one picture each."""
    shots.open("brain.json")
    shots.window.session.select("raycast")
    for name in ("messages", "profile", "images", "console"):
        shots.window.docks[name].raise_()
        shots.wait(0.5)
        shots.take(f"panel_{name}")
    shots.window.docks["help"].raise_()
    shots.take("panel_help")


SCENES: dict[str, Callable[[Shots], None]] = {
    scene.__name__: scene
    for scene in (welcome, gallery, transfer_function, failed, quad, commands, timeline, compare, panels)
}


def main() -> int:
    parser = argparse.ArgumentParser(description="Take pictures of the editor's window.")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"default: all of {', '.join(SCENES)}")
    parser.add_argument("--out", type=Path, default=Path("screenshots"), metavar="FOLDER")
    parser.add_argument("--docs", action="store_true", help="a smaller window, as docs/images has it")
    parser.add_argument("--theme", choices=["dark", "light", "both"], default="both")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    with screen() as platform, tempfile.TemporaryDirectory() as config:
        os.environ["NODEGRAPH_CONFIG"] = config
        print(f"platform {platform or 'of the desktop'}")
        shots = Shots(given.out, given.docs)
        folder = given.out
        for theme in ("dark", "light") if given.theme == "both" else (given.theme,):
            shots.theme(theme)
            shots.folder = folder / theme if given.theme == "both" else folder
            shots.folder.mkdir(exist_ok=True)
            for name in given.scenes or SCENES:
                SCENES[name](shots)
        shots.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
