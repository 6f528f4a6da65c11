"""Disturbances separate odometry from the true pose by the stated amount."""

import itertools
import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.disturbances import CarryTo, Grip, Slip, SlipKind, Teleport
from firstfix.lab.scenarios.motions import Stand
from firstfix.lab.scenarios.phase import Phase
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.robot import Kobuki
from firstfix.lab.simulation.simulation import Disturbance, Moment
from firstfix.lab.simulation.wheels import EXACT_WHEELS
from firstfix.lab.worlds.drawing import Drawing

START = SE2(2.0, 2.0, 0.5)
THERE = SE2(6.0, 2.0, -2.0)


@pytest.fixture(scope="module")
def flat() -> OccupancyGrid:
    """Two rooms of 4 x 4 m without a door: one is carried over the wall."""
    plan = Drawing(8.0, 4.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 4.0, 4.0)
    plan.room(4.0, 0.0, 8.0, 4.0)
    return plan.grid()


def moments_of(grid: OccupancyGrid, *phases: Phase, seed: int = 1) -> list[Moment]:
    script = Scenario(
        [Stand(0.2), *phases, Stand(0.2)], start=START, kobuki=Kobuki(wheels=EXACT_WHEELS)
    )
    return list(run(script, grid, seed))


def counted(moments: list[Moment]) -> SE2:
    """Return how far the wheels turned from beginning to end."""
    return [e.T_odom_base for e in moments[-1].events if isinstance(e, Odometry)][-1]


@pytest.mark.parametrize("disturbance", [Teleport(THERE), CarryTo(THERE, 1.0)])
def test_a_kidnapped_robot_is_elsewhere_with_unchanged_odometry(
    flat: OccupancyGrid, disturbance: Phase
) -> None:
    moments = moments_of(flat, disturbance)
    assert moments[0].T_map_base == START
    assert moments[-1].T_map_base == THERE
    assert counted(moments) == SE2.identity()


def test_somewhere_is_elsewhere_for_every_seed(flat: OccupancyGrid) -> None:
    ends = {moments_of(flat, Teleport(), seed=seed)[-1].T_map_base for seed in range(5)}
    assert len(ends) == 5


def test_what_a_carried_sensor_sees_depends_on_the_grip(flat: OccupancyGrid) -> None:
    def near(grip: Grip) -> float:
        moments = moments_of(flat, CarryTo(THERE, 1.0, grip))
        scans = [m.scan for m in moments if m.phase == "carry" and m.scan]
        assert len(scans) == 10
        return float(np.mean([np.mean(scan.ranges < 0.6) for scan in scans]))

    assert near(Grip.COVERED) > 0.97  # a few returns are lost
    assert 0.15 < near(Grip.HANDS) < 0.8
    assert near(Grip.OPEN) < near(Grip.HANDS)


def test_the_carrier_is_gone_afterwards(flat: OccupancyGrid) -> None:
    scan = moments_of(flat, CarryTo(THERE, 0.5, Grip.COVERED))[-1].scan
    assert scan is not None
    assert scan.ranges.min() > 1.0


@pytest.mark.parametrize("seed", range(4))
def test_a_push_moves_the_robot_and_not_its_odometry(flat: OccupancyGrid, seed: int) -> None:
    moments = moments_of(flat, Slip(0.5, 20.0), seed=seed)
    end = moments[-1]
    assert end.T_map_base.distance_to(START) == pytest.approx(0.5, abs=1e-6)
    assert angle_error(end.T_map_base.yaw, START.yaw) == pytest.approx(math.radians(20.0))
    assert counted(moments) == SE2.identity()
    assert [m.disturbance for m in moments if m.disturbance] == [Disturbance.PUSHED]


def test_spinning_wheels_count_what_the_robot_does_not_do(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, Slip(0.4, -30.0, SlipKind.SPINNING, seconds=1.0))
    assert moments[-1].T_map_base == START
    odometry = [e.T_odom_base for m in moments for e in m.events if isinstance(e, Odometry)]
    way = sum(a.distance_to(b) for a, b in itertools.pairwise(odometry))
    assert way == pytest.approx(0.4, rel=1e-3)
    assert counted(moments).yaw == pytest.approx(math.radians(-30.0))
    assert [m.disturbance for m in moments if m.disturbance] == [Disturbance.SLIPPED]
