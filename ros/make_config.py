"""Writes ros/config/firstfix.yaml from the dataclasses: ``python ros/make_config.py``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from firstfix.ros.parameters import parameters

FILE = Path(__file__).parent / "config" / "firstfix.yaml"
HEAD = """# All parameters of the node, with their defaults: keep the lines that you change.
# Names are those of Nav2's AMCL; docs/reference/settings.md has the ranges.
/**:
  ros__parameters:
    # whether a simulator or a bag gives the time
    use_sim_time: false
    # With rclpy there is one more: the node configures and activates itself, without a manager.
    # autostart: true
"""


def text() -> str:
    """Return the whole file."""
    lines: list[str] = []
    for parameter in parameters():
        first, _, part = parameter.name.partition(".")
        if part in ("", "x"):
            meaning = parameter.description
            if parameter.choices:
                meaning += f"; one of {', '.join(parameter.choices)}"
            lines.append(f"    # {meaning}\n")
        if part == "x":
            lines.append(f"    {first}:\n")
        indent = "      " if part else "    "
        lines.append(f"{indent}{part or first}: {_shown(parameter.default)}\n")
    return HEAD + "".join(lines)


def _shown(value: Any) -> str:
    quoted = '"' if isinstance(value, str) else None
    return yaml.safe_dump(value, default_style=quoted).splitlines()[0]


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
