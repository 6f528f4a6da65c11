"""Draws in ARCHITECTURE.md which packages import which: ``python docs/make_import_graph.py``."""

from __future__ import annotations

from pathlib import Path

import grimp

PAGE = Path(__file__).parents[1] / "ARCHITECTURE.md"
BEGIN, END = "```mermaid\n", "```\n"
# The top may import all packages and all import the bottom: those arrows would hide the others.
TOP, BOTTOM = "cli", "core"
PACKAGES = (
    "lab",
    "fleet",
    "web",
    "ros",
    "vda5050",
    "site",
    "localizer",
    "io",
    "plots",
    "belief",
    "amcl",
    "changes",
    "global_localization",
    "fields",
)
# Of the exception that import-linter allows: a method of `ScanMatcher` imports when it is called.
UPWARDS = {("global_localization", "belief")}


def imports() -> set[tuple[str, str]]:
    """Return pairs of packages: the importing one, the imported one."""
    graph = grimp.build_graph("firstfix")
    pairs = {
        (_package(importer), _package(imported))
        for importer in graph.modules
        for imported in graph.find_modules_directly_imported_by(importer)
    }
    return {(above, below) for above, below in pairs if above and below and above != below}


def page_with(pairs: set[tuple[str, str]], page: str) -> str:
    """Replace the Mermaid diagram of a page; arrows that a longer way implies are left out."""
    head, _, rest = page.partition(BEGIN)
    names = [f'    {name}["{name}"]\n' for name in PACKAGES]
    downwards = {pair for pair in pairs - UPWARDS if set(pair) <= set(PACKAGES)}
    drawn = [
        f"    {above} {'-.->' if (above, below) in UPWARDS else '-->'} {below}\n"
        for above in PACKAGES
        for below in PACKAGES
        if (above, below) in pairs and not _is_implied(above, below, downwards)
    ]
    return head + BEGIN + "flowchart TD\n" + "".join(names + drawn) + END + rest.partition(END)[2]


def _is_implied(above: str, below: str, pairs: set[tuple[str, str]]) -> bool:
    """Return whether a longer way leads from one package to another."""
    between = [name for top, name in pairs if top == above and name != below]
    return any((name, below) in pairs or _is_implied(name, below, pairs) for name in between)


def _package(module: str) -> str:
    """Return the package of a module; empty for modules at the top level."""
    name = module.removeprefix("firstfix.").partition(".")[0]
    return name if name in (TOP, *PACKAGES, BOTTOM) else ""


if __name__ == "__main__":
    PAGE.write_text(page_with(imports(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
