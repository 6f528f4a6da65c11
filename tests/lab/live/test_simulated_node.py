"""A simulated robot and its localizer live in one thread, in real time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_lab import until
from site_lab import save_rooms

from firstfix.core.errors import InputError
from firstfix.core.grid import FREE, OCCUPIED, OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.live.simulated_node import SimulatedNode
from firstfix.lab.live.simulated_robot import SimulatedRobot
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import InitialPose
from firstfix.localizer.states import State
from firstfix.site.site import Site
from firstfix.web.snapshot import AmclEstimate, AmclStart

HOUSE = WORLDS["house"]()


class Diary:
    """A store that records everything."""

    def __init__(self, observer: Any = None) -> None:
        self.given: list[Any] = []
        self.outputs: list[Any] = []
        self.truths: list[SE2] = []
        self.warnings: list[str] = []
        self.map_names: list[str] = []
        self.threads: set[str] = set()
        self.state = State.NO_MAP
        self.amcl: AmclEstimate | None = None
        self._observer = observer

    def __call__(self, given: Any, outputs: list[Any], localizer: Localizer) -> None:
        self.given.append(given)
        self.outputs += outputs
        self.state = localizer.state
        self.threads.add(threading.current_thread().name)
        if self._observer is not None:
            self._observer(given)

    def set_truth(self, T_map_base: SE2) -> None:
        self.truths.append(T_map_base)

    def set_amcl(self, amcl: AmclEstimate | None) -> None:
        self.amcl = amcl

    def skip_time(self) -> None:
        """Measure nothing."""

    def set_map_name(self, name: str) -> None:
        self.map_names.append(name)


@contextmanager
def running(
    robot: SimulatedRobot, observer: Any = None, site: Site | None = None
) -> Iterator[tuple[SimulatedNode, Diary]]:
    diary = Diary(observer)
    node = SimulatedNode(robot, diary, diary.warnings.append, site=site)
    node.start()
    yield node, diary
    node.stop()


def test_it_is_found_and_its_true_pose_is_sent():
    with running(SimulatedRobot(HOUSE, 1)) as (_, diary):
        until(lambda: diary.state is State.LOCALIZED)
    assert isinstance(diary.given[0], NewMap)
    found = next(output for output in diary.outputs if isinstance(output, InitialPose))
    assert found.T_map_base.distance_to(diary.truths[20]) < 0.1
    assert diary.threads == {"firstfix"}
    assert diary.warnings == []


def test_in_a_site_the_map_is_found_and_named_before_the_pose(tmp_path: Path) -> None:
    site = Site.load(save_rooms(tmp_path))
    worlds = {name: partial(site.grid, name) for name in site.map_ids}
    robot = SimulatedRobot(site.grid("first"), 1, "first", worlds)
    assert robot.worlds == ("first", "ground", "second")
    with running(robot, site=site) as (_, diary):
        until(lambda: diary.state is State.LOCALIZED)
        robot.select_world("second")
        until(lambda: len([g for g in diary.given if isinstance(g, NewMap)]) == 2)
        until(lambda: diary.state is State.LOCALIZED)
    assert [g.map_id for g in diary.given if isinstance(g, NewMap)] == ["first", "second"]
    assert diary.warnings == diary.map_names == []


def test_what_is_given_is_taken_at_once_also_while_the_robot_is_paused():
    robot = SimulatedRobot(HOUSE, 1)
    with running(robot) as (node, diary):
        until(lambda: diary.state is State.LOCALIZED)
        robot.pause()
        hint = PoseHint(0.0, SE2(1.0, 1.0, 0.0))
        node.give(hint)
        until(lambda: hint in diary.given)
        assert diary.state is State.VERIFYING_HINT
        robot.resume()
        until(lambda: diary.state is State.LOCALIZED)


def test_errors_are_reported_and_it_continues():
    wrong = iter(["once"])

    def stumbles(given: Any) -> None:
        if isinstance(given, LaserScan) and next(wrong, None):
            raise RuntimeError("over its own feet")

    with running(SimulatedRobot(HOUSE, 1), stumbles) as (_, diary):
        until(lambda: diary.warnings)
        until(lambda: sum(isinstance(given, LaserScan) for given in diary.given) > 3)
    assert len(diary.warnings) == 1
    assert "over its own feet" in diary.warnings[0]


def test_a_map_that_cannot_be_searched_is_reported():
    cells = np.full((100, 100), FREE, np.int8)
    bare = OccupancyGrid(cells, 0.05)
    with running(SimulatedRobot(bare, 1)) as (_, diary):
        until(lambda: diary.warnings)
        assert "wall" in diary.warnings[0]


def test_the_same_seed_gives_the_same_first_pose():
    poses = []
    for _ in range(2):
        with running(SimulatedRobot(HOUSE, 7)) as (_, diary):
            until(lambda diary=diary: diary.state is State.LOCALIZED)
        first = next(output for output in diary.outputs if isinstance(output, InitialPose))
        poses.append(first.T_map_base)
    assert poses[0] == poses[1]


def test_a_building_without_room_is_refused():
    cells = np.full((10, 10), OCCUPIED, np.int8)
    cells[4:6, 4:6] = FREE
    with pytest.raises(InputError, match="free place"):
        SimulatedRobot(OccupancyGrid(cells, 0.05), 1)


def test_another_world_gets_its_map_a_new_clock_and_a_new_localizer():
    robot = SimulatedRobot(HOUSE, 1)
    with running(robot) as (_, diary):
        until(lambda: diary.state is State.LOCALIZED)
        robot.select_world("rooms")
        until(lambda: diary.map_names)
        until(lambda: diary.state is State.DISAMBIGUATING)
    maps = [given for given in diary.given if isinstance(given, NewMap)]
    assert [given.grid for given in maps] == [HOUSE, robot.grid]
    assert diary.map_names == ["rooms"]
    later = diary.given[diary.given.index(maps[1]) :]
    assert next(given.stamp for given in later if isinstance(given, LaserScan)) < 10.0
    assert diary.warnings == []


def test_a_covered_sensor_keeps_the_pose():
    robot = SimulatedRobot(HOUSE, 1)
    with running(robot) as (_, diary):
        until(lambda: diary.state is State.LOCALIZED)
        robot.cover_sensor(covered=True)
        seen = len(diary.given)
        until(lambda: sum(isinstance(given, LaserScan) for given in diary.given[seen:]) > 20)
        assert diary.state is State.LOCALIZED


def test_a_plain_amcl_stays_where_the_robot_was_kidnapped():
    robot = SimulatedRobot(HOUSE, 1)
    with running(robot) as (_, diary):
        until(lambda: diary.state is State.LOCALIZED)
        robot.run_amcl(AmclStart.POSE)
        until(lambda: diary.amcl)
        before = diary.amcl.T_map_base
        assert before.distance_to(robot.T_map_base) < 0.5
        robot.kidnap()
        until(lambda: diary.truths[-1].distance_to(before) > 1.0)
        seen = len(diary.given)
        until(lambda: sum(isinstance(given, LaserScan) for given in diary.given[seen:]) > 5)
        assert diary.amcl.T_map_base.distance_to(before) < 0.5
        robot.run_amcl(AmclStart.OFF)
        until(lambda: diary.amcl is None)
    assert diary.warnings == []
