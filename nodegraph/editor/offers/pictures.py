"""Small pictures of offered networks. Any thread."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QImage, QPainter

from nodegraph.data import Image
from nodegraph.editor.previews import picture_of
from nodegraph.engine import Engine
from nodegraph.errors import GraphError
from nodegraph.offers import Offer
from nodegraph.requests import default_sinks


def picture_of_offer(engine: Engine, offer: Offer, size: QSize) -> QImage | None:
    """What a network shows, its views beside each other; None where it fails."""
    try:
        flat = offer.network().flatten()
        sinks = default_sinks(flat)
        width = size.width() // len(sinks)
        report = engine.submit(flat, sinks, size=(width, size.height()), quality="interactive").result()
    except GraphError:
        return None
    shown = [value for values in report.shown.values() for value in values.values() if isinstance(value, Image)]
    pictures = [picture for picture in map(picture_of, shown) if picture is not None]
    if not pictures:
        return None
    whole = QImage(width * len(pictures), size.height(), QImage.Format.Format_RGB32)
    whole.fill(Qt.GlobalColor.black)
    painter = QPainter(whole)
    for place, picture in enumerate(pictures):
        painter.drawImage(place * width, 0, picture)
    painter.end()
    return whole
