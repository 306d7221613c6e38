"""What a processor does, from its own declaration, as a page to read."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QTextBrowser

from nodegraph import ports, registry
from nodegraph.editor import theme
from nodegraph.editor.session import Session
from nodegraph.errors import GraphError
from nodegraph.flat import ProcessorClass

EMPTY = """
<h2>Getting around</h2>
<p>Select a node, or a processor in the palette, to read here what it does.</p>
<p><b>Build.</b> Drag processors from the palette onto the canvas, and drag from an output to an input. What fits lights
up.</p>
<p><b>See.</b> A node <i>View</i> opens its own panel. Everything that you change is shown at once.</p>
<p><b>Find.</b> <code>Ctrl+K</code> finds every command, processor and node by its name.</p>
<p><b>Undo.</b> <code>Ctrl+Z</code> takes back anything; a drag is one step.</p>
"""


class Help(QTextBrowser):
    """The page of the node that was selected last, or of the entry that the palette points at."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self._shown: ProcessorClass | None = None
        self.setOpenExternalLinks(True)
        self.document().setDocumentMargin(14)
        session.selected.connect(self._on_select)
        session.replaced.connect(lambda: self.show_class(None))
        self.show_class(None)

    def show_processor(self, id: str) -> None:
        """Show the page of a processor by its id."""
        try:
            self.show_class(registry.find(id))
        except GraphError as error:
            self._shown = None
            self.setHtml(f"{_style(theme.theme_of(self.palette()))}<h2>{_safe(id)}</h2><p>{_safe(str(error))}</p>")

    def show_class(self, processor: ProcessorClass | None) -> None:
        """Show the page of a processor, or how to get around."""
        self._shown = processor
        colors = theme.theme_of(self.palette())
        body = page(processor.describe(), colors) if processor is not None else EMPTY
        self.setHtml(_style(colors) + body)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self.show_class(self._shown)

    def _on_select(self, paths: tuple[str, ...]) -> None:
        node = self.session.network.node(paths[-1]) if paths else None
        if node is not None and node.processor is not None:
            self.show_class(node.processor)


def page(entry: Mapping[str, Any], colors: theme.Theme) -> str:
    """The page of a processor as HTML, from its entry of the catalogue."""
    category, _, name = str(entry["id"]).rpartition(".")
    title = name.replace("_", " ")
    parts = [
        f"<p class='dim'>{_safe(category)}</p><h2>{_safe(title[:1].upper() + title[1:])}</h2>",
        _text(entry["doc"]),
    ]
    for heading, side in (("Inputs", "inputs"), ("Outputs", "outputs")):
        if entry.get(side):
            rows = "".join(_port(name, told) for name, told in entry[side].items())
            parts.append(f"<h3>{heading}</h3>{rows}")
    if entry.get("params"):
        rows = "".join(_parameter(name, told) for name, told in entry["params"].items())
        parts.append(f"<h3>Parameters</h3>{rows}")
    parts.append(f"<p class='dim'><code>{_safe(entry['id'])}</code>, version {entry.get('version', 1)}</p>")
    return "\n".join(parts)


def _port(name: str, told: Mapping[str, Any]) -> str:
    colors = {record.name: record.color for record in ports.port_types()}
    kind = str(told.get("type", ""))
    extra = [word for word in ("many", "optional") if told.get(word)]
    note = f", {', '.join(extra)}" if extra else ""
    return (
        f"<p class='row'><span style='color:{colors.get(kind, '#909090')}'>●</span> <b>{_safe(name)}</b> "
        f"<span class='dim'>{_safe(kind)}{note}</span><br>{_inline(told.get('doc', ''))}</p>"
    )


def _parameter(name: str, told: Mapping[str, Any]) -> str:
    unit = f" {told['unit']}" if told.get("unit") else ""
    facts = [str(told.get("kind", ""))]
    default = told.get("default")
    if isinstance(default, (bool, int, float, str)) and default != "":
        facts.append(f"{default:g}{unit}" if isinstance(default, float) else f"{default}{unit}")
    low, high = told.get("min"), told.get("max")
    if low is not None or high is not None:
        facts.append(f"{'' if low is None else low}..{'' if high is None else high}{unit}")
    if told.get("choices"):
        facts.append(" | ".join(map(str, told["choices"])))
    return (
        f"<p class='row'><b>{_safe(name)}</b> <span class='dim'>{_safe(', '.join(facts))}</span><br>"
        f"{_inline(told.get('doc', ''))}</p>"
    )


def _text(doc: str) -> str:
    blocks = [block for block in re.split(r"\n\s*\n", doc.strip()) if block.strip()]
    return "".join(_block(block) for block in blocks)


def _block(block: str) -> str:
    """A paragraph, or a list where lines begin with a dash."""
    first, *items = re.split(r"^\s*- ", block, flags=re.MULTILINE)
    before = f"<p>{_inline(' '.join(first.split()))}</p>" if first.strip() else ""
    listed = "".join(f"<li>{_inline(' '.join(item.split()))}</li>" for item in items)
    return before + (f"<ul>{listed}</ul>" if listed else "")


def _inline(text: str) -> str:
    marked = re.sub(r"(?<![\w*])\*([^*\s][^*]*)\*(?![\w*])", r"<i>\1</i>", _safe(text))
    return re.sub(r"`+([^`]+)`+", r"<code>\1</code>", marked)


def _safe(text: Any) -> str:
    return html.escape(str(text))


def _style(colors: theme.Theme) -> str:
    return (
        "<style>"
        f"body {{ color: {colors.text}; }} p {{ margin: 0 0 8px 0; line-height: 130%; }}"
        "ul { margin: 0 0 8px 14px; -qt-list-indent: 0; } li { margin: 0 0 3px 0; }"
        "h2 { margin: 0 0 8px 0; font-size: 17px; } h3 { margin: 14px 0 6px 0; font-size: 13px; }"
        f".dim {{ color: {colors.dim}; }} .row {{ margin: 0 0 7px 0; }} code {{ color: {colors.accent}; }}"
        "</style>"
    )
