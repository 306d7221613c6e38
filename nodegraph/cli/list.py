"""List the processors of this installation and its plug-ins; those that cannot be loaded with the reason."""

from __future__ import annotations

import argparse
import json

from nodegraph.cli.terminal import answer, say
from nodegraph.errors import near_miss


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("words", nargs="*", metavar="WORD", help="only processors whose id or text has all these words")
    parser.add_argument("--json", action="store_true", help="print every declaration as one JSON document")


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import registry

    wanted = [word.lower() for word in arguments.words]
    entries = [
        entry
        for entry in registry.catalogue()
        if all(word in f"{entry['id']} {entry.get('doc', '')}".lower() for word in wanted)
    ]
    if arguments.json:
        answer(json.dumps(entries, indent=1))
        return 0
    if not entries:
        ids = [word for id in registry.ids() for word in (id, *id.replace("_", ".").split("."))]
        say(f"no processor has {' and '.join(wanted)} in its id or text{near_miss(' '.join(wanted), ids)}")
    width = max((len(entry["id"]) for entry in entries), default=0)
    for entry in entries:
        if "unavailable" in entry:
            text = f"unavailable: {entry['unavailable']} ({entry['file']})"
        else:
            text = entry["doc"].split("\n", 1)[0]
        answer(f"{entry['id']:{width}}  {text}")
    return 0
