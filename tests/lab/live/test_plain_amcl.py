"""A plain AMCL follows a robot from where it starts, and no further than its motion model."""

from __future__ import annotations

from firstfix.core.se2 import SE2
from firstfix.lab.live.plain_amcl import PlainAmcl
from firstfix.lab.live.simulated_robot import SimulatedRobot
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.web.snapshot import AmclStart

HOUSE = WORLDS["house"]()


def test_it_waits_for_a_pose_and_tracks_from_it() -> None:
    robot, amcl = SimulatedRobot(HOUSE, 1), PlainAmcl(HOUSE, AmclStart.POSE)
    known: SE2 | None = None
    for i in range(200):
        if i == 60:
            assert amcl.estimate is None
            known = robot.T_map_base
        moment = robot.step()
        amcl.follow(moment.events, known)
    assert amcl.estimate.T_map_base.distance_to(moment.T_map_base) < 0.3


def test_it_starts_anywhere_with_the_first_scan_and_repeats() -> None:
    def run() -> SE2:
        robot, amcl = SimulatedRobot(HOUSE, 1), PlainAmcl(HOUSE, AmclStart.UNIFORM)
        for _ in range(40):
            amcl.follow(robot.step().events, None)
        return amcl.estimate.T_map_base

    assert run() == run()
