"""Searching the panel, and showing only what is not at its default."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from nodegraph.editor.parameters import ParameterPanel


@pytest.fixture
def section(panel: ParameterPanel) -> Any:
    found = panel.sections["all"]
    found.complete()
    return found


def shown(section: Any) -> list[str]:
    return [name for name, row in section.rows.items() if not row.isHidden()]


def test_words_look_at_names_and_docs(panel: Any, section: Any) -> None:
    everything = shown(section)
    panel.bar.search.setText("powers TEN")
    assert shown(section) == ["tiny"]
    panel.bar.search.setText("soft")
    assert shown(section) == ["amount"]
    panel.bar.search.setText("zebra")
    assert shown(section) == []
    assert section.nothing.text() == "nothing that suits the search"
    assert section.nothing.isVisible()
    panel.bar.search.setFocus()
    QTest.keyClick(panel.bar.search, Qt.Key.Key_Escape)
    assert shown(section) == everything
    assert not section.nothing.isVisible()


def test_only_what_is_set_linked_or_wired(panel: Any, section: Any, session: Any) -> None:
    net = session.network
    net.set("all.amount", 3.0)
    net.link("all.count", "many")
    net.connect("number.number", "all.free")
    panel.bar.changed.setChecked(True)
    assert shown(section) == ["amount", "free", "count"]
    net.set("all.on", True)
    assert "on" in shown(section)
    session.undo()
    assert "on" not in shown(section)
    with session.gesture("drag"):
        net.set("all.amount", 1.0)
        assert "amount" in shown(section), "what is in the hand stays, though it is at its default"
    net.set("all.tiny", 0.5)
    assert "amount" not in shown(section)


def test_a_search_stays_when_another_node_is_selected(panel: Any, session: Any, qtbot: Any) -> None:
    panel.bar.search.setText("powers")
    session.select("other")
    panel.sections["other"].complete()
    assert shown(panel.sections["other"]) == ["tiny"]
    session.select("all")
    panel.sections["all"].complete()
    assert shown(panel.sections["all"]) == ["tiny"]
    panel.bar.clear()
    assert len(shown(panel.sections["all"])) > 20


def test_it_is_offered_where_there_is_much(panel: Any, session: Any) -> None:
    assert panel.bar.isVisible()
    assert panel.viewportMargins().top() == panel.bar.height()
    session.select("cube")
    assert not panel.bar.isVisible()
    assert panel.viewportMargins().top() == 0
    panel.start_search()
    session.select("all")
    panel.start_search()
    assert panel.bar.search.hasFocus()
    panel.bar.search.setText("tiny")
    session.select("cube")
    assert panel.bar.isVisible(), "else nobody could see why its parameter is hidden"
