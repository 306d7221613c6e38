"""Write the generated pages: one for each processor, their index, and the schema of workspaces."""

from __future__ import annotations

import argparse

from nodegraph.cli.terminal import answer, say


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the docs (default: docs/ of this checkout, else ./docs)"
    )
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 when a page is not current")


def run(arguments: argparse.Namespace) -> int:
    from pathlib import Path

    from nodegraph import docs_pages, formats

    folder = Path(arguments.out) if arguments.out else docs_pages.default_folder()
    pages = docs_pages.pages()
    changed = docs_pages.stale(folder, pages)
    if arguments.check:
        for name in changed:
            say(f"{folder / name} is not current; run: nodegraph docs")
        return 1 if changed else 0
    for name in changed:
        path = folder / name
        if name in pages:
            formats.make_folder(path.parent)
            with formats.replacing(path) as part:
                part.write_text(pages[name], "utf-8")
        else:
            path.unlink()
        answer(str(path))
    return 0
