"""The generated pages of the docs: one for each built-in processor, their index, and the schema of workspaces.

A page says what the declaration says; nothing is written twice. `nodegraph docs` writes the pages; `nodegraph docs
--check` and the tests find those that are not current.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from nodegraph import locations

FOLDER = "processors"
SCHEMA = "workspace.schema.json"
_BOUNDS = {"min": "at least", "max": "at most"}


def default_folder() -> Path:
    """docs/ of this checkout; for an installed package docs/ of the current folder."""
    docs = locations.home() / "docs"
    return docs if docs.is_dir() else Path("docs")


def pages() -> dict[str, str]:
    """Every generated page: path below the docs folder to text."""
    from nodegraph import registry, schema

    entries = [entry for entry in registry.catalogue() if entry["origin"] == "nodegraph" and "unavailable" not in entry]
    made = {f"{FOLDER}/{entry['id']}.md": page(entry) for entry in entries}
    made[f"{FOLDER}/index.md"] = index(entries)
    made[SCHEMA] = json.dumps(schema.workspace_schema(), indent=1) + "\n"
    return made


def stale(folder: Path, made: Mapping[str, str]) -> list[str]:
    """Names of pages in ``folder`` that are missing, differ from ``made``, or belong to no processor any more."""
    changed = []
    for name, text in made.items():
        try:
            current = (folder / name).read_text("utf-8")
        except FileNotFoundError:
            current = None
        if current != text:
            changed.append(name)
    orphans = (f"{FOLDER}/{path.name}" for path in sorted((folder / FOLDER).glob("*.md")))
    return changed + [name for name in orphans if name not in made]


def page(entry: Mapping[str, Any]) -> str:
    """The page of one processor, from its entry of the catalogue."""
    parts = [f"# {entry['id']}", entry["doc"]]
    if entry.get("effect"):
        parts.append("An effect: it changes the world, is never cached, and runs only where it is asked for.")
    for title, ports in (("Inputs", entry["inputs"]), ("Outputs", entry["outputs"])):
        if ports:
            parts.append(f"## {title}\n\n{_table(('name', 'type', 'what'), map(_port, ports.items()))}")
    if entry["params"]:
        head = ("name", "kind", "default", "range", "what")
        parts.append(f"## Parameters\n\n{_table(head, map(_parameter, entry['params'].items()))}")
    parts.append(f"## In a workspace\n\n```json\n{_example(entry)}\n```")
    parts.append(_footer(entry))
    return "\n\n".join(parts) + "\n"


def index(entries: Iterable[Mapping[str, Any]]) -> str:
    """The list of all processors by category."""
    parts = ["# Processors", "Generated from the declarations by `nodegraph docs`."]
    categories: dict[str, list[tuple[str, ...]]] = {}
    for entry in entries:
        link = f"[{entry['id']}]({entry['id']}.md)"
        categories.setdefault(entry["id"].rpartition(".")[0], []).append((link, _first_sentence(entry["doc"])))
    for category, rows in categories.items():
        parts.append(f"## {category}\n\n{_table(('processor', 'what'), rows)}")
    return "\n\n".join(parts) + "\n"


def _first_sentence(text: str) -> str:
    return " ".join(text.split("\n\n", 1)[0].split())


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _port(item: tuple[str, Mapping[str, Any]]) -> tuple[str, ...]:
    name, port = item
    notes = [port["doc"]]
    if not port.get("required", True):
        notes.append("Optional.")
    if port.get("many"):
        notes.append("Takes any number of wires.")
    if port.get("accepts"):
        notes.append(f"It {'; '.join(port['accepts'])}.")
    return f"`{name}`", port["type"], " ".join(notes)


def _parameter(item: tuple[str, Mapping[str, Any]]) -> tuple[str, ...]:
    name, told = item
    notes = [told["doc"]]
    if "visible_if" in told:
        conditions = (f"`{other}` is {_alternatives(values)}" for other, values in told["visible_if"].items())
        notes.append(f"Used where {' and '.join(conditions)}.")
    if "quality" in told:
        quality = told["quality"]
        better = " < ".join(quality) if isinstance(quality, list) else quality
        notes.append(f"Accuracy: {better}.")
    if "reference" in told:
        notes.append(f"Reference: {', then '.join(map(str, told['reference']))}.")
    return f"`{name}`", told["kind"], _default(told), _range(told), " ".join(notes)


def _alternatives(values: Iterable[Any]) -> str:
    words = [f"`{json.dumps(value).strip(chr(34))}`" for value in values]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _default(told: Mapping[str, Any]) -> str:
    value = told["default"]
    if isinstance(value, dict):
        return ""  # cameras, lights, transfer functions: a line of JSON says less than the kind
    if value == "":
        return "none"
    return f"`{json.dumps(value).strip(chr(34))}`" + (f" {told['unit']}" if told.get("unit") else "")


def _range(told: Mapping[str, Any]) -> str:
    if "choices" in told:
        return ", ".join(f"`{choice}`" for choice in told["choices"])
    hard = [f"{_BOUNDS[end]} {told[end]}" for end in ("min", "max") if end in told]
    soft = [str(told[end]) for end in ("soft_min", "soft_max") if end in told]
    if soft:
        hard.append(
            f"slider {'from' if 'soft_max' not in told else 'to' if len(soft) == 1 else ''} {' to '.join(soft)}"
        )
    return ", ".join(" ".join(part.split()) for part in hard)


def _example(entry: Mapping[str, Any]) -> str:
    node: dict[str, Any] = {"type": entry["id"], "version": entry["version"]}
    required = {
        name: f"a_node.{port['type'].lower()}" for name, port in entry["inputs"].items() if port.get("required", True)
    }
    if required:
        node["inputs"] = required
    return json.dumps({entry["id"].rpartition(".")[2]: node})[1:-1]


def _footer(entry: Mapping[str, Any]) -> str:
    path = entry["id"].replace(".", "/")
    suffix = Path(entry["file"]).suffix
    parts = [f"Version {entry['version']}. Source: [`processors/{path}{suffix}`](../../processors/{path}{suffix})"]
    parts += [f"[`shaders/{name}.glsl`](../../shaders/{name}.glsl)" for name in entry.get("kernels", ())]
    text = ", ".join(parts) + "."
    if entry.get("formerly"):
        text += f" Formerly {', '.join(entry['formerly'])}."
    if entry.get("disk_cache"):
        text += " Results are kept on disk across runs."
    return text
