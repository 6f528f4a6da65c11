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
    # whether a simulator or a bag provides the time
    use_sim_time: false
    # With rclpy only: the node configures and activates itself, without a lifecycle manager.
    # autostart: true
"""


def text() -> str:
    """Return the whole file."""
    lines: list[str] = []
    group = meaning = ""
    for parameter in parameters():
        before, (group, _, name) = group, parameter.name.rpartition(".")
        if group and group != before:
            lines.append(f"    {group}:\n")
        words = f"; one of {', '.join(parameter.choices)}" if parameter.choices else ""
        previous, meaning = meaning, parameter.description + words
        indent = "      " if group else "    "
        if meaning != previous:
            lines.append(f"{indent}# {meaning}\n")
        lines.append(f"{indent}{name}: {_shown(parameter.default)}\n")
    return HEAD + "".join(lines)


def _shown(value: Any) -> str:
    quoted = '"' if isinstance(value, str) else None
    return yaml.safe_dump(value, default_style=quoted).splitlines()[0]


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
