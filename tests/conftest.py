"""Fixtures that several packages of tests use."""

import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.drawing import Drawing

# Fixtures behind which other programs run: a browser, a roscore, peers, a broker, a cluster.
REAL_PARTS = {"chromium", "ros1", "dds", "mqtt", "cluster"}

# Hypothesis draws 100 by default; other runs draw other examples.
CHECK_EXAMPLES = 30

# Message types that are in neither store.
DEFINITIONS = {
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav2_msgs/msg/Particle": "geometry_msgs/Pose pose\nfloat64 weight",
    "nav2_msgs/msg/ParticleCloud": "std_msgs/Header header\nParticle[] particles",
    "kobuki/msg/CliffEvent": "uint8 sensor\nuint8 state\nuint16 bottom",
    "kobuki/msg/WheelDropEvent": "uint8 wheel\nuint8 state",
    "kobuki/msg/BumperEvent": "uint8 bumper\nuint8 state",
}


class Wire:
    """Real messages of one ROS version, and what arrives at the receiver."""

    def __init__(self, store: Stores) -> None:
        self._store = get_typestore(store)
        self.is_ros1 = store is Stores.ROS1_NOETIC
        for name, definition in DEFINITIONS.items():
            if name not in self._store.types:
                self._store.register(get_types_from_msg(definition, name))

    def make(self, type_name: str, /, **fields: Any) -> Any:
        """Build a message of ``package/Type``, as a transport does."""
        if self.is_ros1 and type_name == "std_msgs/Header":
            fields["seq"] = 0
        name = type_name.replace("/", "/msg/")
        known = self._store.fielddefs[name][1]
        return self._store.types[name](**{f: self._zero(kind) for f, kind in known} | fields)

    def _zero(self, described: Any) -> Any:
        """Return the value of a field that is not given, as clients of ROS do."""
        kind, detail = described
        if kind is Nodetype.NAME:
            return self.make(detail.replace("/msg/", "/"))
        if kind is Nodetype.BASE:
            return {"string": "", "bool": False}.get(detail[0], 0)
        is_number = detail[0][0] is Nodetype.BASE and detail[0][1][0] not in ("string", "bool")
        return np.zeros(detail[1], detail[0][1][0]) if is_number else []

    def sent(self, message: Any) -> Any:
        """Serialize and deserialize a message."""
        kind = message.__msgtype__
        if self.is_ros1:
            return self._store.deserialize_ros1(self._store.serialize_ros1(message, kind), kind)
        return self._store.deserialize_cdr(self._store.serialize_cdr(message, kind), kind)


@pytest.fixture(
    scope="session", params=[Stores.ROS1_NOETIC, Stores.ROS2_HUMBLE], ids=["ros1", "ros2"]
)
def wire(request: pytest.FixtureRequest) -> Wire:
    """Give the messages of ROS 1, then of ROS 2."""
    return Wire(request.param)


@pytest.fixture(scope="session")
def ros2() -> Wire:
    """Give the messages of ROS 2."""
    return Wire(Stores.ROS2_HUMBLE)


def pytest_configure(config: pytest.Config) -> None:
    """Set how many examples hypothesis draws, without a deadline: the machine may be busy.

    `make check` leaves out slow tests, and draws fewer examples than `make test`.
    """
    if not config.pluginmanager.hasplugin("hypothesispytest"):
        return  # the Python of ROS, which runs the tests of the nodes only
    from hypothesis import settings

    settings.register_profile("all", deadline=None)
    settings.register_profile("check", deadline=None, max_examples=CHECK_EXAMPLES)
    if config.getoption("--hypothesis-profile") is None:
        settings.load_profile("check" if config.option.markexpr == "not slow" else "all")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let a test that needs a real part try once more; the summary names those that did.

    Why: docs/decisions/0033-tests-with-real-parts.md.
    """
    if not config.pluginmanager.hasplugin("rerunfailures"):
        return
    for item in items:
        if not REAL_PARTS.isdisjoint(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.flaky(reruns=1))


@pytest.fixture(scope="session")
def shared() -> Path:
    """Give the folder with recorded data, which is not in the repository; skip if it is absent."""
    sibling = Path(__file__).resolve().parents[1].parent / "shared"
    folder = Path(os.environ.get("FIRSTFIX_SHARED", sibling))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set FIRSTFIX_SHARED to the one with the recorded data")
    return folder


@pytest.fixture(scope="session", autouse=True)
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Keep cached maps and incidents of tests and of their processes out of the user's folders."""
    folder = tmp_path_factory.mktemp("firstfix-cache")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("FIRSTFIX_CACHE_DIR", str(folder))
        environment.setenv("FIRSTFIX_INCIDENT_DIR", str(tmp_path_factory.mktemp("incidents")))
        yield folder


@pytest.fixture
def on_small_disk(tmp_path: Path) -> Callable[..., None]:
    """Give a function that runs a program with a disk of 64 kB mounted at argv[1]."""
    alone, disk = ["unshare", "--map-root-user", "--mount"], tmp_path / "disk"
    mount = 'mount -t tmpfs -o size=64k tmpfs "$0"'
    disk.mkdir()
    if shutil.which("unshare") is None:
        pytest.skip("no unshare in PATH")
    try_it: list[Any] = [*alone, "sh", "-c", mount, disk]
    tried = subprocess.run(try_it, capture_output=True, text=True, check=False)
    if tried.returncode:
        pytest.skip(f"nothing may be mounted here: {tried.stderr.strip()}")

    def run(program: str) -> None:
        then = f'{mount} && exec "$1" -c "$2" "$0"'
        command: list[Any] = [*alone, "sh", "-c", then, disk, sys.executable, program]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert list(disk.iterdir()) == []  # nothing was written to the disk below

    return run


@pytest.fixture
def full_after() -> Callable[[int], Any]:
    """Give a context that limits the size of every file of this process, in bytes."""
    resource = pytest.importorskip("resource")

    @contextmanager
    def full(size: int) -> Iterator[None]:
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))

    return full


@pytest.fixture(scope="session")
def hall_plan() -> OccupancyGrid:
    """A hall of 9 x 7 m without symmetry: a corner is cut off, and there is a block."""
    plan = Drawing(9.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 9.0, 7.0)
    plan.solid(0.1, 5.0, 2.0, 6.9)
    plan.solid(6.0, 2.0, 6.5, 3.5)
    return plan.grid()


@pytest.fixture(scope="session")
def driven(hall_plan: OccupancyGrid) -> Recording:
    """A drive of 5.5 m through the hall, 0.1 m and 0.1 s from scan to scan, with a turn.

    The odometry has its own origin, measures 3 % too far and turns 0.2° a scan too much.
    """
    legs = [SE2(0.1, 0.0, 0.0)] * 30 + [SE2(0.0, 0.0, 0.15)] * 10 + [SE2(0.1, 0.0, 0.0)] * 25
    pose, counted = SE2(1.5, 1.5, 0.0), SE2(-3.0, 7.0, 2.0)
    truth, odometry = [pose], [counted]
    for leg in legs:
        pose = pose @ leg
        counted = counted @ SE2(1.03 * leg.x, 0.0, leg.yaw + math.radians(0.2))
        truth.append(pose)
        odometry.append(counted)
    lidar, rng = Lidar(beams=120, T_base_laser=SE2(0.1, 0.0, 0.0)), np.random.default_rng(0)
    stamps = 100.0 + 0.1 * np.arange(len(truth))
    return Recording(
        scans=tuple(
            lidar.scan(hall_plan, pose, rng, stamp)
            for pose, stamp in zip(truth, stamps.tolist(), strict=True)
        ),
        odometry=Trajectory(stamps, np.array([pose.as_array() for pose in odometry])),
        truth=np.array([pose.as_array() for pose in truth]),
    )
