"""The pictures of an animation as files: a folder of PNG, or a film."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nodegraph.animation import Track, moves
from nodegraph.data import Image
from nodegraph.errors import Cancelled, CommandError, FormatError

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network

FILM = ".mp4"

OnFrame = Callable[[int, int], object]
"""Called with the number of the pictures done and of all."""


class Film:
    """An MP4 file that pictures are added to; H.264, even sides, sRGB. It is there whole, or not at all.

    Raises FormatError where the extra ``animation`` is missing, or for a picture of another size than the first.
    """

    def __init__(self, path: Path, rate: int) -> None:
        try:
            import av
        except ImportError:
            raise FormatError("a film needs the extra: pip install 'nodegraph[animation]'", file=str(path)) from None
        from nodegraph.formats import replacing

        self.path = path
        self._av: Any = av
        self._rate = rate
        self._stack = ExitStack()
        self._part = self._stack.enter_context(replacing(path))
        self._container: Any = self._stack.enter_context(av.open(str(self._part), "w", format="mp4"))
        self._stream: Any = None

    def add(self, image: Image) -> None:
        """Add a picture. What is transparent becomes black; an odd last row or column is left out."""
        height, width = (side - side % 2 for side in image.color.shape[:2])
        if width == 0 or height == 0:
            raise FormatError("a film needs pictures of at least 2 x 2 pixels", file=str(self.path))
        if self._stream is None:
            # The quality is that of pictures to be looked at closely; the pixel format that of every player.
            self._stream = self._container.add_stream("libx264", rate=self._rate, options={"crf": "16"})
            self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, "yuv420p"
        if (self._stream.width, self._stream.height) != (width, height):
            raise FormatError("all pictures of a film must have one size", file=str(self.path))
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(screen(image)[:height, :width]), format="rgb24")
        for packet in self._stream.encode(frame):
            self._container.mux(packet)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None and self._stream is not None:
            for packet in self._stream.encode():
                self._container.mux(packet)
        self._stack.__exit__(kind, error, trace)


def screen(image: Image) -> Any:
    """Bytes for a screen, (h, w, 3) sRGB: colour over black, one channel as grey. Raises FormatError for distances."""
    from nodegraph.formats import srgb

    if image.channels == 2:
        raise FormatError("two channels of distances are no picture for a film; show them through a view")
    color = image.over((0.0, 0.0, 0.0)) if image.channels == 4 else np.repeat(image.color, 3, axis=2)
    return (srgb.encode(color) * 255.0 + 0.5).astype(np.uint8)


def render(
    network: Network,
    view: str,
    tracks: Iterable[Track],
    frames: Sequence[int],
    out: Path,
    *,
    engine: Engine,
    size: tuple[int, int] | None = None,
    rate: int = 25,
    on_frame: OnFrame | None = None,
    cancelled: Callable[[], bool] = lambda: False,
) -> list[Path]:
    """Render the frames of a view into a folder, or into a film where ``out`` ends in .mp4. Returns the files.

    The network is moved through time without a note in its history: give it a copy that nobody else uses. Files of
    the folder are called ``view_0000.png`` by their frame and carry the workspace as it was at that frame. Raises
    the first error of a node, Cancelled, FormatError.
    """
    from nodegraph.formats import make_folder
    from nodegraph.pictures import images_of, write_picture

    tracks = list(tracks)
    is_film = out.suffix.lower() == FILM
    make_folder(out.parent if is_film else out)
    files: list[Path] = []
    digits = max(4, *(len(str(abs(frame))) for frame in frames))
    with ExitStack() as stack:
        film = stack.enter_context(Film(out, rate)) if is_film else None
        for done, frame in enumerate(frames):
            if cancelled():
                raise Cancelled("the animation was stopped")
            for command in moves(network, frame, tracks):
                command.apply(network)
            report = engine.evaluate(network, view, size=size)
            report.raise_first()
            images = images_of(report, [view])
            if len(images) != 1:
                raise CommandError(f"{view}: an animation is made of one picture a frame, and this shows {len(images)}")
            (image,) = images.values()
            if film is not None:
                film.add(image)
            else:
                files.append(out / f"{view.replace('/', '.')}_{frame:0{digits}d}.png")
                write_picture(image, files[-1], network)
            if on_frame is not None:
                on_frame(done + 1, len(frames))
    return [out] if is_film else files
