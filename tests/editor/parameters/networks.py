"""Small networks of processors that exist for a test alone, and a panel that shows them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from nodegraph import Network, Processor
from nodegraph.editor.parameters.panel import ParameterPanel
from nodegraph.editor.session import Session
from nodegraph.engine import Engine
from nodegraph.errors import UnknownProcessor

Find = Callable[[str], type[Processor]]


def finder(*known: type[Processor]) -> Find:
    """What finds these processors by their id, and the view of the library."""
    processors = {cls.id: cls for cls in known}

    def find(id: str) -> type[Processor]:
        if id == "output.view":
            from nodegraph import registry

            return registry.find(id)
        if id not in processors:
            raise UnknownProcessor(id, processors)
        return processors[id]

    return find


def session_with(find: Find, **nodes: str) -> Iterator[Session]:
    """A session on nodes, id=type, of which ``all`` reads the volume of ``cube``; closed afterwards."""
    network = Network(find)
    for id, type in nodes.items():
        network.add(type, id)
    network.connect("cube.volume", "all.volume")
    network.history.clear()
    made = Session(network, Engine(disk=False, workers=1))
    yield made
    made.close()


def panel_of(session: Session, qtbot: Any, height: int) -> ParameterPanel:
    """The panel with the node ``all``."""
    shown = ParameterPanel(session)
    qtbot.addWidget(shown)
    shown.resize(380, height)
    shown.show()
    session.select("all")
    return shown
