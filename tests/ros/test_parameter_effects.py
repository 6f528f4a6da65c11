"""Every documented parameter changes what a node does, or is refused with the reason."""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from recorder import Recorder, Speaker, point_cloud

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.lab.worlds.catalog import identical_rooms
from firstfix.ros.channels import (
    INITIAL_POSE,
    PARTICLES,
    Channel,
    published_topics,
    subscriptions,
)
from firstfix.ros.node import Node
from firstfix.ros.parameters import configured

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "settings.md"
DOCUMENTED = re.findall(r"^\| `([\w.]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)

# The scans sharpen the published pose: some of what the filter does is seen in its cloud only.
CLOUD = {"cloud_rate": 50.0}
BEAM = {"laser_model_type": "beam"}
FIELD = {"laser_model_type": "likelihood_field_prob"}
SKIP = FIELD | {"do_beamskip": True}
STILL = {"update_min_d": 50.0, "update_min_a": 3.0}
START = {
    "set_initial_pose": True,
    "initial_pose.x": 3.0,
    "initial_pose.y": 2.5,
    "initial_pose.yaw": 0.4,
}

# Of each parameter: a value other than the default, and the parameters that it depends on. The
# robot drives in a hall; with "in", it gets lost there, or
# it is in one of four equal rooms.
EFFECTS: dict[str, dict[str, Any]] = {
    "mode": {"to": "bootstrap"},
    "yaml_filename": {"to": "map.yaml"},
    "map_id": {"to": "lobby"},
    "base_frame_id": {"to": "base_link"},
    "odom_frame_id": {"to": "wheels"},
    "global_frame_id": {"to": "floor"},
    "scan_topic": {"to": "base_scan"},
    "scan_topics": {"to": "front/scan rear/scan"},
    "cloud_topics": {"to": "points"},
    "depth_topics": {"to": "depth/image"},
    "height_band": {"to": "0.3 1.0", "in": "points", "with": {"cloud_topics": "points"}},
    "laser_pose": {"to": "1.0,0.0,0.0"},
    "laser_frame": {"to": "nowhere"},
    "zones": {"to": "last", "in": "rooms", "with": {"yaml_filename": "rooms.yaml"}},
    "map_topic": {"to": "floor_plan"},
    "first_map_only": {"to": True},
    "changes_layer": {"to": "all_gone.yaml"},
    "set_initial_pose": {"to": True},
    "initial_pose.x": {"to": 7.0, "with": START},
    "initial_pose.y": {"to": 5.5, "with": START},
    "initial_pose.yaw": {"to": 3.0, "with": START},
    "always_reset_initial_pose": {"to": True, "with": START},
    "saved_pose_file": {"to": "pose.json"},
    "save_pose_rate": {"to": -1.0, "with": {"saved_pose_file": "pose.json"}},
    "transform_tolerance": {"to": 0.2},
    "tf_broadcast": {"to": False},
    "cloud_rate": {"to": 50.0},
    "status_rate": {"to": 50.0},
    "scan_timeout": {"to": 60.0},
    "incident_seconds": {"to": 0.0, "in": "a loss"},
    "incident_folder": {"to": "incidents"},
    "alpha1": {"to": 2.0},
    "alpha2": {"to": 2.0},
    "alpha3": {"to": 2.0},
    "alpha4": {"to": 2.0},
    "alpha5": {"to": 2.0, "with": {"robot_model_type": "nav2_amcl::OmniMotionModel"}},
    "robot_model_type": {"to": "nav2_amcl::OmniMotionModel"},
    "laser_model_type": {"to": "beam"},
    "max_beams": {"to": 20},
    "laser_min_range": {"to": 2.0},
    "laser_max_range": {"to": 3.0},
    "laser_likelihood_max_dist": {"to": 0.2},
    "z_hit": {"to": 0.9},
    "z_short": {"to": 0.9, "with": BEAM},
    "z_max": {"to": 0.9, "with": BEAM | {"laser_max_range": 3.0}},
    "z_rand": {"to": 0.1},
    "sigma_hit": {"to": 0.05},
    "lambda_short": {"to": 5.0, "with": BEAM},
    "do_beamskip": {"to": True, "in": "a loss", "with": FIELD},
    "beam_skip_distance": {"to": 0.05, "with": SKIP},
    "beam_skip_threshold": {"to": 0.95, "with": SKIP},
    "beam_skip_error_threshold": {"to": 0.01, "in": "a loss", "with": SKIP},
    "model_unknown_space": {"to": True},
    "min_particles": {"to": 1900},
    "max_particles": {"to": 600},
    "pf_err": {"to": 0.5, "with": {"min_particles": 10}},
    "pf_z": {"to": 4.0, "with": {"min_particles": 10}},
    "resample_interval": {"to": 3},
    "selective_resampling": {"to": True, "with": CLOUD},
    "update_min_d": {"to": 2.0, "with": {"update_min_a": 3.0}},
    "update_min_a": {"to": 2.0, "with": {"update_min_d": 3.0}},
    "random_seed": {"to": 7},
    "site": {"to": "."},
    "load_map_service": {"to": "/map_server/load_map", "with": {"site": "."}},
    "deskew": {"to": False, "in": "a slow laser"},
    "changes.days_kept": {"to": 2},
    "locate.max_poses": {"to": 1000, "in": "a fast robot"},
    "locate.shortlist": {"to": 1, "in": "a fast robot"},
    "locate.unique_probability": {"to": 1.0, "in": "a fast robot"},
    "monitor.doubtful_cost": {"to": 0.01},
    "monitor.contradiction_cost": {"to": 90.0, "in": "a fast robot"},
    "monitor.lost_after_s": {
        "to": 0.1,
        "in": "a fast robot",
        "with": {"monitor.search_period_s": 1000.0},
    },
    "monitor.search_period_s": {"to": 1000.0, "in": "a fast robot"},
    "monitor.confirmations": {"to": 5, "in": "a fast robot"},
    "monitor.rest_period_s": {"to": 0.05, "in": "rooms"},
    # The slip of this drive: a filter that does not update leaves it to the monitor.
    "monitor.correct_m": {"to": 1.0, "in": "the dark", "with": STILL},
    "monitor.correct_rad": {
        "to": 0.003,
        "in": "the dark",
        "with": STILL | {"monitor.correct_m": 1.0},
    },
    "monitor.decided_cost": {"to": 0.002, "in": "a fast robot"},
    "monitor.decided_views": {"to": 1, "in": "a loss", "with": {"belief.window": 1}},
    "belief.window": {"to": 1, "in": "rooms"},
    "belief.memory": {"to": 0, "in": "rooms", "with": {"belief.window": 1}},
    "belief.first_shortlist": {"to": 1, "in": "rooms"},
    "belief.shortlist": {"to": 1, "in": "a loss"},
    "belief.places": {"to": 2, "in": "rooms"},
    "belief.sure_probability": {"to": 1.0, "in": "a short sensor"},
}
REFUSED = {"recovery_alpha_slow": 0.1, "recovery_alpha_fast": 0.1, "locate.hypotheses": 5}
MOTION = SE2(0.3, 0.0, 0.1)


def cloud_of(wire: Any, scan: Any) -> Any:
    """Return the end points of a scan, at heights of 0.15 m and 0.5 m, as a point cloud."""
    bearings = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    x, y = scan.ranges * np.cos(bearings), scan.ranges * np.sin(bearings)
    low = np.column_stack([0.5 * x, 0.5 * y, np.full(len(x), 0.15)])
    points = np.concatenate([low, np.column_stack([x, y, np.full(len(x), 0.5)])])
    return wire.sent(point_cloud(wire.make, scan.header, points))


class Drive:
    """A map, a robot that drives, slips and is carried away, and at last another map."""

    def __init__(
        self,
        wire: Any,
        world: OccupancyGrid,
        start: SE2,
        carried_to: SE2,
        *,
        blinded: int = 0,
        covered: int = 0,
        scans: int = 20,
        reach: float = math.inf,
        sweep_s: float = 0.0,
        as_points: bool = False,
        motion: SE2 = MOTION,
    ) -> None:
        self.wire, self.world = wire, world
        robot = Speaker(wire, world, start)
        self.messages = [(Channel.TF_STATIC, robot.fixed()), (Channel.MAP, robot.map())]
        for i in range(scans):
            if i in (8, 12):
                robot.pose = robot.pose @ SE2(0.12, 0.1, 0.04) if i == 8 else carried_to
            tf, scan = robot.report(lambda channel, message: (channel, message))
            if reach < scan[1].range_max:
                scan[1].range_max = reach
                scan[1].ranges = np.where(scan[1].ranges > reach, np.inf, scan[1].ranges)
            if 0 <= i - 12 < blinded:  # it fits nowhere
                scan[1].ranges = 2.0 + np.sin(np.arange(180.0) * i).astype(np.float32)
            if 0 <= i - 8 < covered:  # else the scans before and after the slip show it
                scan[1].ranges = np.full(180, np.nan, np.float32)
            scan[1].time_increment = sweep_s / 180
            self.messages += [tf, (Channel.CLOUD, cloud_of(wire, scan[1])) if as_points else scan]
            robot.move(motion if i % 2 else SE2.identity(), 0.25)
        robot.world = OccupancyGrid(world.cells[:-10].copy(), world.resolution, world.T_map_grid)
        self.messages.append((Channel.MAP, robot.map()))

    def outcome(self, folder: Path, parameters: dict[str, Any]) -> list[str]:
        """Return all that a node with these parameters subscribes to, publishes, logs and saves."""
        config = configured(parameters)
        recorder = Recorder(self.wire)
        recorder.listening = {PARTICLES.name: 1, INITIAL_POSE.name: 1}
        node = Node(config, recorder)
        shutil.rmtree(node.incidents.folder.path, ignore_errors=True)  # it keeps 20 at most
        if config.yaml_filename or config.changes_layer:
            node._load_own_map()
        node._prepare()
        for channel, message in self.messages:
            node.receive(channel, message)
            node._take_all(node._inbox.take(0.0))
        node._scan_at -= 3.0  # s pass without a scan
        node._check_scans()
        node._memory.close()
        topics = sorted(topic.name for _, topic in subscriptions(config))
        topics += [topic.name for topic in published_topics(config, PARTICLES)]
        # What the live page shows of changes of the map.
        changes = f"changes: {node._localizer.changes is not None}"
        node.incidents.close()
        saved = len(node.incidents.folder.files())
        lines = [f"{node.incidents.folder.path}", f"{saved} incidents", changes]
        return [*topics, *map(str, recorder.published), *map(str, recorder.lines), *lines]


@pytest.fixture(scope="module")
def drives(ros2: Any, hall_plan: OccupancyGrid) -> dict[str, Drive]:
    rooms = identical_rooms(4)
    return {
        "hall": Drive(ros2, hall_plan, SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5)),
        "a loss": Drive(
            ros2, hall_plan, SE2(1.5, 1.5, 0.2), SE2(6.9, 3.0, 1.5), blinded=11, scans=32
        ),
        "the dark": Drive(ros2, hall_plan, SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5), covered=1),
        "a short sensor": Drive(
            ros2, hall_plan, SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5), reach=4.0
        ),
        "points": Drive(ros2, hall_plan, SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5), as_points=True),
        "a slow laser": Drive(
            ros2, hall_plan, SE2(3.0, 2.5, 0.4), SE2(7.5, 5.0, -1.5), sweep_s=0.1
        ),
        # Each scan is so far from the one before that they do not tell whether it was carried.
        "a fast robot": Drive(
            ros2,
            hall_plan,
            SE2(3.0, 2.5, 0.4),
            SE2(7.5, 5.0, -1.5),
            motion=SE2(0.32, 0.0, 0.1),
        ),
        "rooms": Drive(ros2, rooms, SE2(2.0, 2.0, 0.4), SE2(2.5, 2.5, 0.4)),
    }


@pytest.fixture(scope="module")
def known() -> dict[Any, list[str]]:
    """Give the outcomes so far: many parameters are compared with the same one."""
    return {}


@pytest.fixture
def outcome(
    drives: dict[str, Drive],
    known: dict[Any, list[str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
    hall_plan: OccupancyGrid,
) -> Callable[[str, dict[str, Any]], list[str]]:
    monkeypatch.setattr("firstfix.ros.node.precompile", lambda config: None)
    monkeypatch.setattr(
        "firstfix.ros.node.cache_folder", lambda: tmp_path_factory.getbasetemp() / "maps"
    )
    monkeypatch.setattr("firstfix.ros.node.time", SimpleNamespace(monotonic=lambda: 0.0))
    monkeypatch.chdir(tmp_path)
    save_map(OccupancyGrid(np.eye(50, dtype=np.int8) * 100, 0.05), tmp_path / "map.yaml")
    save_map(identical_rooms(4), tmp_path / "rooms.yaml")
    save_map(
        OccupancyGrid(np.zeros_like(hall_plan.cells), hall_plan.resolution, hall_plan.T_map_grid),
        tmp_path / "all_gone.yaml",
    )
    zone = "zones: {last: [[24, 0], [32, 0], [32, 8], [24, 8]]}"
    (tmp_path / "rooms.zones.yaml").write_text(zone)

    saved: list[str] = []
    monkeypatch.setattr(
        "firstfix.ros.pose_memory.save_pose", lambda path, pose: saved.append(f"{path} {pose}")
    )

    def outcome(world: str, parameters: dict[str, Any]) -> list[str]:
        saved.clear()
        key = world, *sorted(parameters.items())
        if key not in known:
            known[key] = drives[world].outcome(tmp_path, parameters) + saved
        return known[key]

    return outcome


def test_every_documented_parameter_is_examined_here() -> None:
    assert set(DOCUMENTED) == set(EFFECTS) | set(REFUSED)
    assert not set(EFFECTS) & set(REFUSED)


@pytest.mark.parametrize("name", REFUSED)
def test_a_parameter_without_effect_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=name):
        configured({name: REFUSED[name]})


def test_the_same_parameters_give_the_same_outcome(outcome: Any, known: Any) -> None:
    before = outcome("rooms", {})
    known.clear()
    assert outcome("rooms", {}) == before


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_a_parameter_has_an_effect(outcome: Any, name: str) -> None:
    effect = EFFECTS[name]
    world, others = effect.get("in", "hall"), effect.get("with", {})
    # Clouds are large: few parameters need them.
    others = {"mode": "full", "cloud_rate": 2.0 if name == "cloud_rate" else 0.0} | others
    assert outcome(world, others) != outcome(world, others | {name: effect["to"]})
