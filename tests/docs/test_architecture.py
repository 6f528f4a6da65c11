"""ARCHITECTURE.md describes the source tree as it is."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "src" / "firstfix"
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")

# "### `core`: value types ..." and the text below it.
SECTION = re.compile(r"^### `(\w+)`[^\n]*\n(.*?)(?=^##)", re.MULTILINE | re.DOTALL)
MODULE = re.compile(r"`([\w/]+\.(?:py|html))`")


def packages(folder: Path) -> set[str]:
    return {init.parent.name for init in folder.glob("*/__init__.py")}


def test_each_package_has_a_section():
    assert {name for name, _ in SECTION.findall(PAGE)} == packages(SOURCES)


def test_each_subpackage_is_named():
    for name, text in SECTION.findall(PAGE):
        named = {module.rpartition("/")[0] for module in MODULE.findall(text)}
        assert packages(SOURCES / name) <= named, f"the table of {name} misses a subpackage"


def test_the_modules_of_a_section_exist():
    for name, text in SECTION.findall(PAGE):
        modules = MODULE.findall(text)
        assert modules
        for module in modules:
            assert (SOURCES / name / module).is_file(), f"no {module} in {name}"


def test_other_modules_exist():
    roots = [ROOT, SOURCES.parent, SOURCES, *(SOURCES / name for name in packages(SOURCES))]
    prose = SECTION.sub("", PAGE)
    for module in MODULE.findall(prose):
        assert any((root / module).is_file() for root in roots), f"no {module}"
