"""What the robot does takes as long as it should and ends where it should."""

import math

import numpy as np
import pytest

from firstfix.core.angles import angle_error
from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import SignalKind
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.motions import Crowd, DriveTo, Pause, Spin, Stand, Wander
from firstfix.lab.scenarios.phase import Phase
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.floor import Floor
from firstfix.lab.simulation.people import Manner
from firstfix.lab.simulation.simulation import Moment
from firstfix.lab.worlds.catalog import WORLDS
from firstfix.lab.worlds.drawing import Drawing

START = SE2(1.0, 1.0, 0.5)


@pytest.fixture(scope="module")
def flat() -> OccupancyGrid:
    """Two rooms of 3 x 3 m with a door between them, and a third that is closed."""
    plan = Drawing(9.0, 3.0, 0.05, 0.5)
    for west in (0.0, 3.0, 6.0):
        plan.room(west, 0.0, west + 3.0, 3.0)
    plan.door(3.0, 2.0)
    return plan.grid()


def moments_of(grid: OccupancyGrid, *phases: Phase, seed: int = 1) -> list[Moment]:
    return list(run(Scenario([*phases, Stand(0.1)], start=START), grid, seed))


def test_a_standing_robot_does_not_move(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, Stand(2.0))
    assert len(moments) == 21
    assert {m.T_map_base for m in moments} == {START}


def test_a_pause_is_silent_and_takes_its_time(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, Stand(0.2), Pause(1.0))
    silent = [m for m in moments if m.phase == "pause"]
    assert len(silent) == 10
    assert all(m.events == () and m.scan is None for m in silent)
    assert moments[-1].stamp == pytest.approx(1.2)
    assert moments[-1].scan is not None


@pytest.mark.slow
@pytest.mark.parametrize("name", WORLDS)
def test_in_every_world_a_wandering_robot_gets_about_and_never_stands_in_a_wall(name: str) -> None:
    floor = Floor(WORLDS[name]())
    moments = list(run(Scenario([Wander(40.0)], furniture=4), floor.grid, seed=3))
    assert len(moments) == 400
    poses = np.array([m.T_map_base.as_array() for m in moments])
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T).sum() > 5.0
    assert all(floor.room_at(x, y) >= 0.18 for x, y, _ in poses.tolist())


def test_a_drive_goes_through_doors_to_its_goal_and_stops(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, DriveTo(SE2(5.0, 1.0, 0.0)), Stand(1.0))
    assert moments[-1].T_map_base.distance_to(SE2(5.0, 1.0, 0.0)) < 0.15
    assert moments[-1].T_map_base == moments[-2].T_map_base


def test_a_drive_gives_up_when_its_time_is_over(flat: OccupancyGrid) -> None:
    assert len(moments_of(flat, DriveTo(SE2(5.0, 1.0, 0.0), seconds=2.0))) == 21


def test_a_goal_behind_walls_is_refused(flat: OccupancyGrid) -> None:
    with pytest.raises(InputError, match="No path leads"):
        moments_of(flat, DriveTo(SE2(7.5, 1.5, 0.0)))


@pytest.mark.parametrize("radians", [math.pi / 2, -2.0, 3.5 * math.pi])
def test_a_spin_turns_by_its_angle(flat: OccupancyGrid, radians: float) -> None:
    moments = moments_of(flat, Spin(radians))
    end = moments[-1].T_map_base
    assert end.distance_to(START) < 1e-9
    assert angle_error(end.yaw, START.yaw + radians) < 0.1
    assert len(moments) * 0.1 == pytest.approx(abs(radians), abs=0.3)


def test_a_crowd_stays_until_it_is_sent_away(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, Stand(0.5), Crowd(5, 1.0), Spin(1.0), Crowd(0), Stand(0.5))
    near = {
        phase: np.mean(
            [np.mean(m.scan.ranges < 1.5) for m in moments if m.scan and m.phase == phase]
        )
        for phase in ("stand", "crowd", "spin")
    }
    assert near["crowd"] > near["stand"] + 0.1
    assert near["spin"] > near["stand"] + 0.1


def test_a_robot_among_walkers_still_arrives(flat: OccupancyGrid) -> None:
    moments = moments_of(flat, Crowd(6, manner=Manner.WALK), DriveTo(SE2(5.0, 1.0, 0.0)))
    assert moments[-1].T_map_base.distance_to(SE2(5.0, 1.0, 0.0)) < 0.15
    assert not [
        s for m in moments for s in m.events if getattr(s, "kind", None) is SignalKind.CLIFF
    ]


def test_a_robot_in_a_nook_wanders_no_longer_than_it_should() -> None:
    plan = Drawing(1.0, 1.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 1.0, 1.0)
    nook = SE2(0.5, 0.5, 0.0)
    moments = list(run(Scenario([Wander(20.0)], start=nook), plan.grid(), 1))
    assert len(moments) == 200
    assert all(m.T_map_base.distance_to(nook) < 0.4 for m in moments)
