"""After a crash: what was lost is offered in a bar, or, where the window comes back by itself, simply there again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodegraph.editor.recovery import Lost, mute_suspects
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.window import Window


def recover(window: Window, lost: Lost) -> bool:
    """Make a lost document the open one, with the nodes muted that may have caused the crash."""
    try:
        network = lost.network()
    except GraphError as error:
        window.session.tell("error", str(error))
        return False
    window.take_over(network)
    mute_suspects(window.session, lost)
    window.autosave.write()
    lost.discard()
    return True


def offer(window: Window, lost: list[Lost]) -> None:
    """Offer what editors that ended unexpectedly left behind, one after the other."""
    if not lost:
        return
    first, *rest = lost

    def take() -> None:
        if recover(window, first):
            offer(window, rest)

    def discard() -> None:
        first.discard()
        offer(window, rest)

    name = first.file.name if first.file else "a network without a file"
    what = f"with unsaved changes of {name}" if first.text else f"with {name} open"
    nodes = ", ".join(one.path for one in first.suspects)
    while_it_ran = f" while {nodes} ran" if nodes else ""
    window.banner.offer(
        f"The editor ended unexpectedly {what}{while_it_ran}.",
        {"Recover": lambda: window.when_safe(take), "Discard": discard},
    )
