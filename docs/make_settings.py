"""Writes docs/reference/settings.md from the dataclasses: ``python docs/make_settings.py``."""

from __future__ import annotations

import math
from pathlib import Path

from firstfix.ros.parameters import Parameter, parameters

PAGE = Path(__file__).parent / "reference" / "settings.md"
HEAD = """# Settings

Of the nodes (`firstfix ros1`, `ros2`, `dds`), as private parameters; and of `firstfix track
--params`, as far as they are those of AMCL. Written by `docs/make_settings.py` from the dataclasses
that check them.

| name | default | range | meaning |
|---|---|---|---|
"""


def page() -> str:
    """Return the whole page."""
    return HEAD + "".join(_row(parameter) for parameter in parameters())


def _row(parameter: Parameter) -> str:
    default = str(parameter.default)
    if isinstance(parameter.default, bool):
        default = default.lower()
    shown = f"`{default}`" if default else "empty"
    return f"| `{parameter.name}` | {shown} | {_range(parameter)} | {parameter.description} |\n"


def _range(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"`{choice}`" for choice in parameter.choices)
    least, most = parameter.least, parameter.most
    if math.isinf(least) and math.isinf(most):
        return ""
    if math.isinf(most):
        return f"{least:g} and more"
    return f"{least:g} to {most:g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
