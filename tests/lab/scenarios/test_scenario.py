"""A script, a map and a seed make one moments."""

import itertools
import math

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.odometry import Odometry, Signal, SignalKind
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Stand, Teleport
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.rigs import Rig
from firstfix.lab.simulation.simulation import Disturbance, Moment
from firstfix.lab.worlds.drawing import Drawing

EVERYTHING = [
    Stand(0.3),
    DriveTo(SE2(4.0, 1.0, 0.0)),
    Teleport(),
    Stand(0.3),
    CarryTo(SE2(1.0, 1.0, 0.0), seconds=1.0),
    Stand(0.3),
]


@pytest.fixture(scope="module")
def flat() -> OccupancyGrid:
    """Two rooms of 3 x 3 m with a door between them."""
    plan = Drawing(6.0, 3.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 3.0, 3.0)
    plan.room(3.0, 0.0, 6.0, 3.0)
    plan.door(3.0, 2.0)
    return plan.grid()


@pytest.fixture(scope="module")
def moments(flat: OccupancyGrid) -> list[Moment]:
    return list(run(Scenario(EVERYTHING, start=SE2(1.0, 1.0, 0.5)), flat, seed=1))


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def reports(moments: list[Moment]) -> list[object]:
    """Make events comparable."""
    return [
        (event.stamp, event.ranges.tolist()) if isinstance(event, LaserScan) else event
        for moment in moments
        for event in moment.events
    ]


def test_a_seed_determines_the_scenario(flat: OccupancyGrid, moments: list[Moment]) -> None:
    script = Scenario(EVERYTHING, start=SE2(1.0, 1.0, 0.5))
    assert reports(list(run(script, flat, seed=1))) == reports(moments)
    assert reports(list(run(script, flat, seed=2))) != reports(moments)


def test_events_come_in_the_order_of_their_stamps(moments: list[Moment]) -> None:
    stamps = [event.stamp for moment in moments for event in moment.events]
    assert stamps == sorted(stamps)
    np.testing.assert_allclose([m.stamp for m in moments], 0.1 * np.arange(len(moments)), atol=1e-9)
    for moment in moments:
        (scan,) = (event for event in moment.events if isinstance(event, LaserScan))
        assert scan.stamp == moment.stamp
        assert sum(isinstance(event, Odometry) for event in moment.events) == 5


def test_phases_follow_one_another_and_what_was_done_to_the_robot_is_marked(
    moments: list[Moment],
) -> None:
    phases = [m.phase for m in moments]
    assert [p for i, p in enumerate(phases) if i == 0 or phases[i - 1] != p] == [
        "stand",
        "drive",
        "stand",
        "carry",
        "stand",
    ]
    marked = [(m.phase, m.disturbance) for m in moments if m.disturbance is not None]
    assert marked == [("stand", Disturbance.TELEPORTED), ("stand", Disturbance.CARRIED)]


def test_a_drive_ends_at_its_goal(moments: list[Moment]) -> None:
    end = next(m for m in moments if m.disturbance is Disturbance.TELEPORTED)
    before = moments[moments.index(end) - 1].T_map_base
    assert before.distance_to(SE2(4.0, 1.0, 0.0)) < 0.15


def test_the_wheels_count_neither_teleports_nor_carrying(moments: list[Moment]) -> None:
    odometry = [e.T_odom_base for m in moments for e in m.events if isinstance(e, Odometry)]
    steps = [a.distance_to(b) for a, b in itertools.pairwise(odometry)]
    assert max(steps) < 0.02
    truth = [m.T_map_base for m in moments]
    assert max(a.distance_to(b) for a, b in itertools.pairwise(truth)) > 0.2


def test_carrying_raises_the_wheel_drop_and_setting_down_clears_it(moments: list[Moment]) -> None:
    signals = [e for m in moments for e in m.events if isinstance(e, Signal)]
    drops = [s for s in signals if s.kind is SignalKind.WHEEL_DROP]
    assert [s.active for s in drops] == [True, False]
    assert drops[0].stamp == next(m.stamp for m in moments if m.phase == "carry")
    assert drops[1].stamp == pytest.approx(drops[0].stamp + 1.0)
    assert moments[-1].T_map_base == SE2(1.0, 1.0, 0.0)


def test_a_scan_has_the_pose_of_the_sensor(moments: list[Moment]) -> None:
    scan = next(e for e in moments[0].events if isinstance(e, LaserScan))
    assert scan.T_base_laser == SE2(0.07, 0.0, 0.0)
    assert len(scan) == 360
    assert math.isclose(scan.angle_increment, math.radians(1.0))


@pytest.mark.parametrize(
    "script",
    [
        Scenario([Stand(0.1)], start=SE2(0.15, 1.0, 0.0)),
        Scenario([Stand(0.1), Teleport(SE2(3.0, 1.0, 0.0))], start=SE2(1.0, 1.0, 0.0)),
        Scenario([CarryTo(SE2(70.0, 1.0, 0.0))], start=SE2(1.0, 1.0, 0.0)),
    ],
)
def test_a_robot_is_not_put_into_a_wall(flat: OccupancyGrid, script: Scenario) -> None:
    with pytest.raises(InputError, match="too close to a wall"):
        next(run(script, flat, seed=1))


def test_furniture_is_seen_though_no_map_has_it(flat: OccupancyGrid) -> None:
    start = SE2(1.0, 1.0, 0.0)
    exact = Lidar(sigma_m=0.0)
    bare, full = (
        next(run(Scenario([Stand(0.1)], start, rig=Rig((exact,)), furniture=n), flat, seed=1)).scan
        for n in (0, 3)
    )
    assert bare is not None
    assert full is not None
    np.testing.assert_array_equal(bare.ranges, exact.scan(flat, start, rng()).ranges)
    assert (full.ranges <= bare.ranges).all()
    assert (full.ranges < bare.ranges - 0.1).any()
