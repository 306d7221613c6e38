"""Palette, messages, profile, help and console: what they show of a session."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from nodegraph import registry
from nodegraph.commands import Add
from nodegraph.editor import theme
from nodegraph.editor.command_palette import Entry, rank
from nodegraph.editor.console import Console
from nodegraph.editor.help import Help, page
from nodegraph.editor.messages import Message, Messages, parts
from nodegraph.editor.palette import MIME, Palette
from nodegraph.editor.profile import Profile, bytes_text, seconds_text
from nodegraph.editor.session import Session
from nodegraph.report import CLEAN, Report


@pytest.fixture
def palette(session: Session, qtbot: QtBot) -> Palette:
    made = Palette(session)
    qtbot.addWidget(made)
    qtbot.waitUntil(lambda: len(made.ids()) > 5, timeout=10000)
    return made


def test_the_palette_finds_by_name_by_doc_and_by_the_types_of_ports(palette: Palette) -> None:
    everything = palette.shown()
    palette.search.setText("blur")
    assert palette.shown() == ["filter.gaussian_blur"]
    palette.search.setText("mesh volume box")
    assert "geometry.proxy_box" in palette.shown()
    palette.search.setText("xylophone")
    assert palette.shown() == []
    assert not palette.nothing.isHidden()
    palette.search.clear()
    assert palette.shown() == everything
    assert set(everything) == set(registry.ids())


def test_enter_chooses_and_a_drag_carries_the_id(palette: Palette, qtbot: QtBot) -> None:
    palette.search.setText("blur")
    with qtbot.waitSignal(palette.chosen) as chosen:
        qtbot.keyClick(palette.search, Qt.Key.Key_Return)
    assert chosen.args == ["filter.gaussian_blur"]
    item = palette.tree.currentItem()
    assert item is not None
    assert bytes(palette.tree.mimeData([item]).data(MIME).data()) == b"filter.gaussian_blur"


@pytest.mark.parametrize(
    ("path", "text", "expected"),
    [
        ("a", "a.step: 9 is outside 1..4; choose less", ("a.step", "9 is outside 1..4", "Choose less")),
        ("", "saved /x.json", ("", "Saved /x.json", "")),
        ("a", "about something else", ("a", "About something else", "")),
    ],
)
def test_place_fault_and_cure_stand_apart(path: str, text: str, expected: tuple[str, str, str]) -> None:
    assert parts(Message("error", path, text)) == expected


def test_a_message_selects_its_node_and_goes_when_that_is_well(session: Session, qtbot: QtBot) -> None:
    panel = Messages(session)
    qtbot.addWidget(panel)
    session.do(Add("source.synthetic", "volume"))
    session.tell("error", "volume: it broke; mend it", "volume")
    session.tell("error", "volume: it broke; mend it", "volume")
    session.tell("info", "device gl")
    assert [message.level for message in panel.messages()] == ["error", "info"]
    assert panel.summary.text() == "1 error"
    assert panel.grab().width() > 0  # paints
    panel._go(panel.list.item(0))
    assert session.selection == ("volume",)
    session.finished.emit(Report(states={"volume": CLEAN}))
    assert [message.level for message in panel.messages()] == ["info"]
    assert panel.summary.text() == "No errors"


def test_the_profile_puts_the_dearest_first_and_memos_below_their_node(session: Session, qtbot: QtBot) -> None:
    panel = Profile(session)
    qtbot.addWidget(panel)
    panel.show_report(
        Report(
            states={"ct": CLEAN, "ray": CLEAN, "view": CLEAN},
            timings={"ct": 0.25, "ray": 1.5, "ray/leaps": 0.5},
            bytes={"ct": 2_000_000, "ray": 1000},
        )
    )
    rows = [panel.tree.topLevelItem(place) for place in range(3)]
    assert [[row.text(0), row.text(1), row.text(3)] for row in rows if row is not None] == [
        ["ray", "1.50 s", "1.0 kB"],
        ["ct", "250.0 ms", "2.0 MB"],
        ["view", "kept", ""],
    ]
    assert rows[0] is not None
    inside = rows[0].child(0)
    assert inside is not None
    assert inside.text(0) == "leaps"
    assert panel.summary.text() == "1.75 s in 2 nodes, 1 kept from before, 2.0 MB made"
    assert (seconds_text(2e-5), bytes_text(3_200_000_000)) == ("20 µs", "3.20 GB")


def test_every_processor_has_a_page(session: Session, qtbot: QtBot) -> None:
    panel = Help(session)
    qtbot.addWidget(panel)
    assert "Getting around" in panel.toPlainText()
    for entry in registry.catalogue():
        text = page(entry, theme.DARK)
        assert all(f"<b>{name}</b>" in text for name in (*entry["inputs"], *entry["outputs"], *entry["params"]))
    session.do(Add("filter.gaussian_blur", "blur"))
    session.select("blur")
    assert "filter.gaussian_blur" in panel.toPlainText()
    panel.show_processor("no.such")
    assert "no such processor" in panel.toPlainText()


def test_entries_that_begin_with_a_word_come_first() -> None:
    def of(kind: str, text: str, words: str = "") -> Entry:
        return Entry(kind, text, lambda: None, "", words)

    entries = [of("Add", "Gaussian blur", "filter"), of("Command", "Filter"), of("Go to", "prefilter")]
    ranks = [rank(entry, ["filter"]) for entry in entries]
    assert ranks == [4, 0, 2]
    assert rank(entries[0], ["gaussian", "nothing"]) is None


def test_the_console_edits_the_document_as_one_step(session: Session, qtbot: QtBot) -> None:
    console = Console(session)
    qtbot.addWidget(console)

    def type_line(text: str) -> None:
        qtbot.keyClicks(console.line, text)
        qtbot.keyClick(console.line, Qt.Key.Key_Return)

    type_line("a = net.add('source.synthetic', 'a'); b = net.add('filter.gaussian_blur', 'b')")
    type_line("net.connect('a.volume', 'b.volume'); print(len(net), 'nodes')")
    assert list(session.network.nodes) == ["a", "b"]
    assert "2 nodes" in console.output.toPlainText()
    type_line("net.nothing")
    assert "AttributeError" in console.output.toPlainText()
    session.undo()
    session.undo()
    assert not session.network.nodes
    qtbot.keyClick(console.line, Qt.Key.Key_Up)
    assert console.line.text() == "net.nothing"
