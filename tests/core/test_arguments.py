"""Arguments of the public API: converted where unambiguous, else refused with a remedy."""

from collections.abc import Callable
from enum import Enum
from typing import Any

import numpy as np
import pytest

import firstfix as ff
from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.core.arguments import as_instance, as_member, as_pose, choices
from firstfix.core.errors import InputError
from firstfix.core.odometry import Signal, SignalKind
from firstfix.localizer.inputs import PoseHint

ENUMS = [ff.Method, ff.Mounting, SignalKind, MotionModel, SensorModel, ff.Verdict]


def scan(**changes: Any) -> ff.LaserScan:
    numbers = {"angle_min": -3.1, "angle_increment": 0.1, "range_min": 0.1, "range_max": 8.0}
    return ff.LaserScan(np.ones(60), **{**numbers, **changes})


@pytest.fixture(scope="module")
def matcher(hall_plan: ff.OccupancyGrid) -> ff.ScanMatcher:
    return ff.ScanMatcher(hall_plan)


@pytest.mark.parametrize("kind", ENUMS)
def test_every_member_is_accepted_as_itself_its_value_and_its_name(kind: type[Enum]) -> None:
    for member in kind:
        for given in (member, member.name, member.name.lower()):
            assert as_member(kind, given, "x") is member
        if isinstance(member.value, str):
            assert as_member(kind, member.value.upper(), "x") is member


@pytest.mark.parametrize("kind", ENUMS)
@pytest.mark.parametrize("value", ["", "quick", 1, 0, -1, None, True, np.zeros(3), ["fast"]])
def test_anything_else_is_refused_and_the_choices_are_named(kind: type[Enum], value: Any) -> None:
    with pytest.raises(InputError, match="as one of") as caught:
        as_member(kind, value, "x")
    assert all(choice in str(caught.value) for choice in choices(kind))


@pytest.mark.parametrize("pose", [(1, 2, 0.5), [1.0, 2.0, 0.5], np.array([1.0, 2.0, 0.5])])
def test_three_numbers_are_a_pose(pose: Any) -> None:
    assert as_pose(pose, "x") == ff.SE2(1.0, 2.0, 0.5)


@pytest.mark.parametrize(
    "value", [None, 1.0, "abc", "123", (1, 2), (1, 2, "north"), (1, 2, np.nan), np.zeros((3, 3))]
)
def test_what_is_no_pose_is_refused_and_the_units_are_named(value: Any) -> None:
    with pytest.raises(InputError, match=r"\(x, y, yaw\) in metres and radians"):
        as_pose(value, "x")


def test_an_instance_passes_and_any_other_type_is_refused() -> None:
    assert as_instance(int, 3, "x") == 3
    with pytest.raises(InputError, match="expected x as an int, received 'three'"):
        as_instance(int, "three", "x")


# --- the public API uses them ---


def test_the_name_of_a_method_selects_it(hall_plan: ff.OccupancyGrid) -> None:
    for method in ff.Method:
        assert ff.ScanMatcher(hall_plan, method=method.value).method is method


def test_enums_and_poses_of_the_inputs_are_converted() -> None:
    made = scan(T_base_laser=(0.1, 0.0, 0.0), mounting="upside_down")
    assert made.T_base_laser == ff.SE2(0.1, 0.0, 0.0)
    assert made.mounting is ff.Mounting.UPSIDE_DOWN
    assert np.array_equal(made.bearings, -scan().bearings)
    assert Signal(0.0, "wheel_drop", True).kind is SignalKind.WHEEL_DROP
    assert ff.Odometry(0.0, (1, 2, 3)).T_odom_base == ff.SE2(1, 2, 3)
    assert PoseHint(0.0, [1, 2, 3]).T_map_base == ff.SE2(1, 2, 3)
    lidar = ff.Lidar(T_base_laser=(0.1, 0.0, 0.0), mounting="upside_down")
    assert lidar.T_base_laser == ff.SE2(0.1, 0.0, 0.0)
    assert lidar.mounting is ff.Mounting.UPSIDE_DOWN
    config = AmclConfig(laser_model_type="beam", robot_model_type="stationary")
    assert config.laser_model_type is SensorModel.BEAM
    assert config.robot_model_type is MotionModel.STATIONARY


WRONG: list[tuple[str, Callable[[ff.OccupancyGrid, ff.ScanMatcher], Any]]] = [
    ("fast, paper, paper-basic", lambda grid, _: ff.ScanMatcher(grid, method="quick")),
    (r"ff\.load_map\('map\.yaml'\)", lambda *_: ff.ScanMatcher("map.yaml")),
    ("LocateConfig", lambda grid, _: ff.ScanMatcher(grid, config={"max_poses": 1})),
    (r"ff\.LaserScan\(ranges, angle_min", lambda _, matcher: matcher.locate(np.zeros(360))),
    ("LaserScan", lambda _, matcher: matcher.search_locally([1.0], (0, 0, 0))),
    ("metres and radians", lambda _, matcher: matcher.search_locally(scan(), (0, 0))),
    ("upright, upside_down", lambda *_: scan(mounting="sideways")),
    ("metres and radians", lambda *_: scan(T_base_laser=0.1)),
    ("wheel_drop", lambda *_: Signal(0.0, "bump", True)),
    ("likelihood_field_prob", lambda *_: AmclConfig(laser_model_type="laser")),
    ("metres and radians", lambda *_: ff.OccupancyGrid(np.zeros((2, 2), np.int8), 0.1, (0, 0))),
    ("LocalizerConfig", lambda *_: ff.Localizer({"seed": 1})),
    ("AmclConfig", lambda *_: ff.LocalizerConfig(amcl={"max_beams": 30})),
    (r"ff\.load_map", lambda *_: ff.NewMap(0.0, "map.yaml")),
    (r"ff\.NewMap\(stamp, grid\)", lambda grid, _: ff.Localizer().handle(grid)),
]


@pytest.mark.parametrize(("remedy", "call"), WRONG)
def test_the_error_of_a_wrong_argument_names_what_to_pass(
    remedy: str,
    call: Callable[[ff.OccupancyGrid, ff.ScanMatcher], Any],
    hall_plan: ff.OccupancyGrid,
    matcher: ff.ScanMatcher,
) -> None:
    with pytest.raises(InputError, match=remedy):
        call(hall_plan, matcher)
