"""``firstfix doctor``: what is installed, and whether it works here."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import platform
import socket
import sys
import tempfile
import time
import urllib.parse
from pathlib import Path
from typing import Annotated

import typer

from firstfix import __version__
from firstfix.cli.progress import working

PACKAGES = (
    "numpy",
    "numba",
    "llvmlite",
    "pillow",
    "pyyaml",
    "rosbags",
    "typer",
    "rich",
    "platformdirs",
    "starlette",
    "uvicorn",
    "websockets",
    "msgspec",
)
EXTRAS = {
    "matplotlib": "missing, no pictures: pip install 'firstfix[plot]'",
    "cyclonedds": "missing, no ROS 2 without ROS: pip install 'firstfix[dds]'",
}

# What a node of ROS uses where it is there: a client library, and messages that few have.
CLIENTS = ("rclpy", "rospy")
MESSAGES = ("tf2_msgs", "diagnostic_msgs", "nav2_msgs", "kobuki_ros_interfaces")
VARIABLES = ("ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_LOCALHOST_ONLY", "CYCLONEDDS_URI")
_PATIENCE_S = 1.0

# Part of the message that numba raises where a kernel is declared.
_NO_CACHE = "no matcher available"


def doctor(
    map_path: Annotated[
        Path | None, typer.Argument(metavar="[MAP]", help="A map to try, as map_server reads it.")
    ] = None,
    as_object: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Print what is installed, and whether caches, kernels, ROS and a map work.

    Exit status 1 if the kernels do not work, 2 if the map cannot be used.
    """
    report: dict[str, str] = {}

    def tell(title: str, text: str) -> None:
        report[title] = text
        if not as_object:
            typer.echo(f"{title:<13}{text}")

    tell("firstfix", f"{__version__} in {Path(__file__).parents[1]}")
    tell("python", f"{platform.python_version()} on {platform.platform()}, {sys.prefix}")
    tell("cores", f"{os.cpu_count()}, {_usable_cores()} of them for this process; a scan takes one")
    for package in PACKAGES:
        tell(package, _version(package) or "missing: run pip install firstfix again")
    for package, without in EXTRAS.items():
        tell(package, _version(package) or without)
    tell("cache", _cache())
    with working("compiling the kernels, which takes half a minute at most"):
        kernels, works = _kernels()
    tell("kernels", kernels)
    if map_path is not None and works:
        tell("map", _map(map_path))
    tell("ROS", _ros())
    if as_object:
        typer.echo(json.dumps({"works": works, "report": report}))
    if not works:
        raise typer.Exit(1)


def cache_advice(error: RuntimeError) -> str | None:
    """Return a sentence with a remedy if numba cannot store compiled kernels; else None."""
    if _NO_CACHE not in str(error):
        return None
    return (
        "expected a folder where compiled kernels can be kept, received none that can be written; "
        "set NUMBA_CACHE_DIR to one"
    )


def _usable_cores() -> int:
    # Containers and taskset give a process fewer than there are; some systems do not report it.
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cache() -> str:
    from firstfix.fields.cache import cache_folder

    folder = cache_folder()
    size = sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) if folder.exists() else 0
    text = f"{folder}, {size / 1e6:.1f} MB"
    if _can_be_written(folder):
        return text
    return f"{text}, cannot be written: every start prepares its map again; set FIRSTFIX_CACHE_DIR"


def _can_be_written(folder: Path) -> bool:
    there = next(path for path in (folder, *folder.parents) if path.exists())
    try:
        # A folder that is not there yet is made when it is needed, in the nearest that is.
        with tempfile.TemporaryFile(dir=there):
            return True
    except OSError:
        return False


def _kernels() -> tuple[str, bool]:
    """Describe the kernels, and return whether they work."""
    try:
        return _tried_kernels(), True
    except RuntimeError as error:
        sentence = cache_advice(error)
        if sentence is None:
            raise
        return sentence, False


def _tried_kernels() -> str:
    from firstfix.amcl.config import AmclConfig, SensorModel
    from firstfix.core.se2 import SE2
    from firstfix.fields.kernel_cache import kernel_folder
    from firstfix.global_localization.precompile import scan_of, small_room
    from firstfix.global_localization.scan_matcher import ScanMatcher
    from firstfix.localizer.precompile import precompile

    start = time.perf_counter()
    for model in SensorModel:
        # Only one model skips beams; to the others it makes no difference.
        precompile(AmclConfig(laser_model_type=model, do_beamskip=True))
    loaded = time.perf_counter() - start
    grid = small_room()
    result = ScanMatcher(grid).locate(scan_of(grid, SE2(3.0, 2.5, 0.4)))
    return (
        f"ready after {loaded:.2f} s; then {result.elapsed_s:.3f} s a scan ({result.verdict.value})"
        f"; kept in {kernel_folder()}"
    )


def _map(path: Path) -> str:
    from firstfix.io.maps.check import check_map
    from firstfix.io.maps.map_server import load_map

    load_map(path)
    found = check_map(path)
    text = f"{found.width_m:.1f} x {found.height_m:.1f} m, {found.free_area:.0f} m² free"
    if found.warnings:
        return f"{text}; {len(found.warnings)} warnings: firstfix map check {path}"
    return f"{text}, no traps"


def _ros() -> str:
    distribution = os.environ.get("ROS_DISTRO")
    clients, messages = _found(CLIENTS), _found(MESSAGES)
    if distribution is None and not clients:
        text = "not found; maps, bags, scans in files and firstfix dds work without it"
    else:
        text = f"{distribution or 'no ROS_DISTRO'}, {' and '.join(clients) or 'no client library'}"
    if messages:
        text += f"; {', '.join(messages)}"
    for name in VARIABLES:
        if os.environ.get(name):
            text += f"; {name}={os.environ[name]}"
    if "rospy" in clients:
        text += f"; {_master()}"
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    if "rclpy" in clients and sys.prefix not in prefixes:
        text += f"; for ros2 run: export AMENT_PREFIX_PATH={sys.prefix}:$AMENT_PREFIX_PATH"
    return text


def _master() -> str:
    uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
    try:
        where = urllib.parse.urlsplit(uri)
        with socket.create_connection((where.hostname, where.port or 80), _PATIENCE_S):
            return f"a master at {uri}"
    except (OSError, ValueError):
        return f"no master at {uri} (ROS_MASTER_URI)"


def _found(names: tuple[str, ...]) -> list[str]:
    return [name for name in names if importlib.util.find_spec(name) is not None]
