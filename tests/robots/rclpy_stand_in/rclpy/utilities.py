"""Arguments of a command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from rclpy.graph import Arguments, RCLError


def remove_ros_args(args: list[str] | None = None) -> list[str]:
    return parsed(args or []).others


def parsed(args: list[str]) -> Arguments:
    """Read arguments of the forms ``-p name:=value``, ``-r from:=to`` and ``--params-file``."""
    found = Arguments()
    words, is_for_ros = iter(args), False
    for word in words:
        if word == "--ros-args":
            is_for_ros = True
        elif word == "--":
            is_for_ros = False
        elif not is_for_ros:
            found.others.append(word)
        elif word == "--params-file":
            _read(Path(next(words)), found)
        elif word in ("-p", "-r"):
            name, sign, value = next(words).partition(":=")
            if not sign:
                raise RCLError(f"failed to parse {word} {name}")
            if word == "-p":
                found.parameters[name] = yaml.safe_load(value)
            else:
                found.remappings[name] = value
        else:
            raise RCLError(f"unknown ROS argument {word}")
    return found


def _read(path: Path, found: Arguments) -> None:
    for section in yaml.safe_load(path.read_text()).values():
        found.parameters |= dict(_flat(section["ros__parameters"], ""))


def _flat(tree: dict[str, Any], prefix: str) -> Any:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
