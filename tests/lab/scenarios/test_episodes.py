"""What became of the robot: every figure with a story in which it counts, and one in which not."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.episodes import Act, Scene, tell_acts

HERE, ELSEWHERE = SE2(1.0, 2.0, 0.5), SE2(7.0, 2.0, 0.5)


def scene(stamp: float, published: SE2 | None = HERE, **changes: object) -> Scene:
    usual = Scene(stamp, HERE, published, None, "LOCALIZED", "", 0, False, 0.001)
    return replace(usual, **changes)  # type: ignore[arg-type]


def one_act(*scenes: Scene) -> Act:
    (act,) = tell_acts(scenes)
    return act


@pytest.mark.parametrize(
    ("off", "right"),
    [
        (SE2(0.49, 0.0, 0.0), True),
        (SE2(0.51, 0.0, 0.0), False),
        (SE2(0.0, 0.0, math.radians(9.9)), True),
        (SE2(0.0, 0.0, math.radians(-10.1)), False),
    ],
)
def test_right_is_half_a_metre_and_ten_degrees(off: SE2, *, right: bool) -> None:
    assert scene(0.0, HERE @ off).is_right is right


def test_a_robot_that_is_found_at_once_and_followed() -> None:
    act = one_act(scene(3.0, initial=HERE), scene(3.1), scene(3.2, HERE @ SE2(0.1, 0.0, 0.0)))
    assert (act.began_s, act.noticed_s, act.found_s, act.wrong_finds) == (3.0, 0.0, 0.0, 0)
    assert act.kept == 1.0
    assert act.rmse_m == pytest.approx(0.1 / math.sqrt(3))
    assert act.went_well


def test_a_kidnap_is_noticed_when_the_old_pose_is_given_up() -> None:
    scenes = [scene(0.0, ELSEWHERE), scene(0.1, ELSEWHERE), scene(0.2, None), scene(0.5)]
    act = one_act(*scenes)
    assert act.noticed_s == pytest.approx(0.2)
    assert act.found_s == pytest.approx(0.5)


def test_what_is_never_noticed_and_never_found() -> None:
    act = one_act(scene(0.0, ELSEWHERE), scene(0.1, ELSEWHERE))
    assert (act.noticed_s, act.found_s) == (None, None)
    assert math.isnan(act.kept)
    assert not act.went_well


def test_to_be_found_where_one_is_not_is_no_success() -> None:
    scenes = [scene(0.0, ELSEWHERE, initial=ELSEWHERE), *(scene(0.1 * i) for i in range(1, 300))]
    act = one_act(*scenes)
    assert act.wrong_finds == 1
    assert not act.went_well


def test_to_be_found_and_lost_again_is_none_either() -> None:
    act = one_act(scene(0.0), scene(0.1), scene(0.2, ELSEWHERE), scene(0.3, None))
    assert act.kept == 0.5
    assert not act.went_well


def test_time_counts_from_when_the_robot_stands_again() -> None:
    carried = [scene(0.1 * i, None, lifted=True) for i in range(40)]
    act = one_act(*carried, scene(4.0, None), scene(4.1))
    assert act.began_s == 4.0
    assert act.found_s == pytest.approx(0.1)


def test_acts_are_told_apart() -> None:
    acts = tell_acts([scene(0.0), scene(0.1, act=1), scene(0.2, ELSEWHERE, act=2)])
    assert [act.found_s for act in acts] == [0.0, 0.0, None]
