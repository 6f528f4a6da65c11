"""A node starts and localizes a robot with only the packages that nodes need.

An import hook stands for an environment without all other packages: the laboratory, the page, the
commands, matplotlib, and so on.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

NEEDED = ("numpy", "numba", "llvmlite", "yaml", "platformdirs", "msgspec")
LEFT_OUT = ("cli", "lab", "plots", "web")

HOOK = f"""
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        top, _, rest = name.partition(".")
        if top == "firstfix":
            absent = rest.partition(".")[0] in {LEFT_OUT}
        else:
            absent = top not in {NEEDED} and top not in sys.stdlib_module_names and top[0] != "_"
        if absent:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Absent())
"""

NODE = """
import time
from types import SimpleNamespace

import numpy as np

from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.io.ros_messages.incoming import to_planar, to_pose
from firstfix.io.ros_messages.outgoing import laser_scan, occupancy_grid, transforms
from firstfix.global_localization.precompile import small_room
from firstfix.ros.channels import INITIAL_POSE, PARTICLES, STATUS, Channel
from firstfix.ros.node import Node
from firstfix.ros.node_config import NodeConfig

class Transport:
    particles = PARTICLES

    def __init__(self):
        self.published = []

    def make(self, type_name, /, **fields):
        return SimpleNamespace(**fields)

    def publish(self, topic, message):
        self.published.append((topic, message))

    def subscriber_count(self, topic):
        return 1

    def log(self, severity, text):
        print(text, file=sys.stderr)

transport = Transport()
make, grid, pose = transport.make, small_room(), SE2(3.0, 2.5, 0.4)
# A sensor that sees the whole room: one scan of a short one is never enough.
bearings = np.radians(np.arange(360.0))
ranges = expected_ranges(grid, pose, bearings, 12.0).astype(np.float32)
scan = LaserScan(ranges, 0.0, float(bearings[1]), range_min=0.1, range_max=12.0, stamp=1.0)
node = Node(NodeConfig(), transport)
node.start()
node.receive(Channel.MAP, occupancy_grid(make, 1.0, "map", grid))
node.receive(Channel.TF_STATIC, transforms(make, 0.0, "base_footprint", "laser", SE2.identity()))
node.receive(Channel.TF, transforms(make, 1.0, "odom", "base_footprint", SE2.identity()))
node.receive(Channel.SCAN, laser_scan(make, "laser", scan))
end = time.monotonic() + 240.0
poses = []
while not poses and time.monotonic() < end:
    time.sleep(0.01)
    poses = [message for topic, message in transport.published if topic is INITIAL_POSE]
node.stop()
print(to_planar(to_pose(poses[0])).distance_to(pose) < 0.1)
"""


def run(program: str, cache: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", HOOK + program],
        env=os.environ | {"FIRSTFIX_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_a_node_localizes_a_robot_with_the_needed_packages_only(tmp_path: Path) -> None:
    done = run(NODE, tmp_path)
    assert done.stdout == "True\n", done.stderr


@pytest.mark.parametrize(
    "module",
    ["firstfix.lab", "firstfix.cli.app", "matplotlib", "typer", "rich", "PIL", "starlette"],
)
def test_the_hook_hides_all_other_packages(module: str, tmp_path: Path) -> None:
    done = run(f"import {module}", tmp_path)
    assert f"No module named '{module.split('.app', maxsplit=1)[0]}'" in done.stderr


@pytest.mark.parametrize("module", ["node", "names", "parameters", "arguments", "pose_memory"])
def test_the_parts_of_nodes_import_without_the_other_packages(module: str, tmp_path: Path) -> None:
    done = run(f"import firstfix.ros.{module}", tmp_path)
    assert done.returncode == 0, done.stderr
