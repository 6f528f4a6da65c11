"""``firstfix doctor``: what is installed, and whether it works here."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import platform
import sys
import time

import typer

from firstfix import __version__

PACKAGES = ("numpy", "numba", "pillow", "pyyaml", "rosbags", "typer", "rich", "platformdirs")
PLOTTING = "matplotlib"
DDS = "cyclonedds"

# What a node of ROS uses where it is there: a client library, and messages that few have.
CLIENTS = ("rclpy", "rospy")
MESSAGES = ("tf2_msgs", "diagnostic_msgs", "nav2_msgs", "kobuki_ros_interfaces")


def doctor() -> None:
    """Say what is installed, where the cache is, whether the kernels work and ROS is seen."""
    _say("firstfix", __version__)
    _say("python", f"{platform.python_version()} on {platform.platform()}, {os.cpu_count()} cores")
    for package in PACKAGES:
        _say(package, _version(package) or "missing: run pip install firstfix again")
    _say(PLOTTING, _version(PLOTTING) or "missing, no pictures: pip install 'firstfix[plot]'")
    _say(DDS, _version(DDS) or "missing, no ROS 2 without ROS: pip install 'firstfix[dds]'")
    _say("cache", _cache())
    _say("kernels", _kernels())
    _say("ROS", _ros())


def _say(title: str, text: str) -> None:
    typer.echo(f"{title:<13}{text}")


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cache() -> str:
    from firstfix.fields.cache import cache_folder

    folder = cache_folder()
    size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) if folder.exists() else 0
    return f"{folder}, {size / 1e6:.1f} MB"


def _kernels() -> str:
    import numpy as np

    from firstfix.core.se2 import SE2
    from firstfix.global_localization.locate import Locator
    from firstfix.sim.lidar import Lidar
    from firstfix.sim.world import identical_rooms

    start = time.perf_counter()
    grid = identical_rooms(1)
    scan = Lidar().scan(grid, SE2(2.0, 2.0, 0.5), np.random.default_rng(0))
    locator = Locator(grid, cache_dir=None)
    locator.locate(scan)
    loaded = time.perf_counter() - start
    result = locator.locate(scan)
    return (
        f"ready after {loaded:.2f} s; then {result.elapsed_s:.3f} s a scan ({result.verdict.value})"
    )


def _ros() -> str:
    distribution = os.environ.get("ROS_DISTRO")
    clients, messages = _found(CLIENTS), _found(MESSAGES)
    if distribution is None and not clients:
        return "not seen; not needed for maps, bags and scans in files, nor for firstfix dds"
    said = f"{distribution or 'no ROS_DISTRO'}, {' and '.join(clients) or 'no client library'}"
    if messages:
        said += f"; {', '.join(messages)}"
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    if "rclpy" in clients and sys.prefix not in prefixes:
        said += f"; for ros2 run: export AMENT_PREFIX_PATH={sys.prefix}:$AMENT_PREFIX_PATH"
    return said


def _found(names: tuple[str, ...]) -> list[str]:
    return [name for name in names if importlib.util.find_spec(name) is not None]
