"""Draws in ARCHITECTURE.md which rooms import which: ``python docs/make_import_graph.py``."""

from __future__ import annotations

from pathlib import Path

import grimp

PAGE = Path(__file__).parents[1] / "ARCHITECTURE.md"
BEGIN, END = "```mermaid\n", "```\n"
# The roof imports all rooms, and all rooms stand on the floor: those arrows would hide the others.
ROOF, FLOOR = "cli", "core"
ROOMS = (
    "lab",
    "web",
    "ros",
    "localizer",
    "io",
    "plots",
    "amcl",
    "global_localization",
    "fields",
)


def imports() -> set[tuple[str, str]]:
    """Return pairs of rooms: the one that imports, the one that is imported."""
    graph = grimp.build_graph("firstfix")
    pairs = {
        (_room(importer), _room(imported))
        for importer in graph.modules
        for imported in graph.find_modules_directly_imported_by(importer)
    }
    return {(above, below) for above, below in pairs if above and below and above != below}


def page_with(pairs: set[tuple[str, str]], page: str) -> str:
    """Put the drawing, in the language of Mermaid, into a page where there is one already."""
    head, _, rest = page.partition(BEGIN)
    names = [f'    {_id(room)}["{room.replace(".", "/")}"]\n' for room in ROOMS]
    drawn = [
        f"    {_id(above)} --> {_id(below)}\n"
        for above in ROOMS
        for below in ROOMS
        if (above, below) in pairs
    ]
    return head + BEGIN + "flowchart TD\n" + "".join(names + drawn) + END + rest.partition(END)[2]


def _room(module: str) -> str:
    """Return the room of a module; what stands at the door has none."""
    path = module.removeprefix("firstfix.")
    found = [room for room in (ROOF, *ROOMS, FLOOR) if f"{path}.".startswith(f"{room}.")]
    return max(found, key=len, default="")


def _id(room: str) -> str:
    return room.replace(".", "_")


if __name__ == "__main__":
    PAGE.write_text(page_with(imports(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
