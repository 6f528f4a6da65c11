"""``firstfix ros1``, ``ros2`` and ``dds``: the node on a robot."""

from __future__ import annotations

import importlib
from types import ModuleType

import typer

from firstfix.core.errors import InputError

# Whatever follows is for ROS.
PASSED_ON = {"allow_extra_args": True, "ignore_unknown_options": True}


def ros1(context: typer.Context) -> None:
    """Run the node for ROS 1: it finds the robot, and tells AMCL or follows it itself.

    Arguments are those of rosrun: `scan:=base_scan _mode:=full _base_frame_id:=base_link`.
    """
    adapter = _load(
        "ros1",
        "rospy",
        "source ROS's setup.bash, or run firstfix in an environment "
        "made by `/usr/bin/python3 -m venv --system-site-packages`",
    )
    adapter.run(context.args)


def _load(name: str, library: str, remedy: str) -> ModuleType:
    try:
        return importlib.import_module(f"firstfix.adapters.{name}")
    except ModuleNotFoundError as error:
        raise InputError(
            expected=f"{library} in this Python",
            received=f"no module {error.name}",
            remedy=remedy,
        ) from error
