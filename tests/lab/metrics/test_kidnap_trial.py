"""What became of a kidnapped robot, on sequences that are made by hand."""

from collections.abc import Sequence
from dataclasses import replace

import pytest

from firstfix.core.se2 import SE2
from firstfix.lab.metrics.kidnap_trial import Instant, Trial, judge_trial

HOME, AWAY = SE2(0.0, 0.0, 0.0), SE2(5.0, 0.0, 0.0)
PERIOD_S = 0.5


def stood(seconds: float, truth: SE2, published: SE2 | None, **more: object) -> list[Instant]:
    """A robot at rest and its published pose; None while searching."""
    instant = Instant(0.0, truth, HOME, localized=published is not None, published=published)
    return [replace(instant, **more)] * round(seconds / PERIOD_S)  # type: ignore[arg-type]


def timed(*parts: Sequence[Instant]) -> list[Instant]:
    """Put parts one after another, twice a second."""
    instants = [instant for part in parts for instant in part]
    return [replace(instant, stamp=PERIOD_S * i) for i, instant in enumerate(instants)]


def after(kind: str, part: list[Instant], **more: object) -> list[Instant]:
    """Let a part begin with the end of a disturbance."""
    return [replace(part[0], over=kind, **more), *part[1:]]  # type: ignore[arg-type]


def found(part: list[Instant], fix: SE2) -> list[Instant]:
    """Let a robot be found at the beginning of a part."""
    return [replace(part[0], fixes=(fix,)), *part[1:]]


CALM = found(stood(15.0, HOME, HOME), HOME)
MISLED_1S = after("teleport", stood(1.0, AWAY, HOME))


def test_a_kidnap_that_is_noticed_and_mended() -> None:
    trial = judge_trial(
        timed(CALM, MISLED_1S, stood(0.5, AWAY, None), found(stood(15.0, AWAY, AWAY), AWAY))
    )
    (kidnap,) = trial.aftermaths
    assert (kidnap.kind, kidnap.stamp, kidnap.signalled) == ("teleport", 15.0, False)
    assert kidnap.is_kidnap
    assert kidnap.known_before
    assert kidnap.is_detected
    assert kidnap.left_after_s == pytest.approx(1.0)
    assert kidnap.recovered_after_s == pytest.approx(1.5)
    assert (trial.alarms, trial.wrong_fixes, trial.strays) == ((), (), ())


def test_the_start_is_recovered_from_like_a_kidnap_but_is_none() -> None:
    trial = judge_trial(timed(stood(2.0, HOME, None), CALM))
    assert trial.start is not None
    assert not trial.start.is_kidnap
    assert trial.start.recovered_after_s == pytest.approx(2.0)
    assert trial.first_fix is True
    assert trial.aftermaths == ()


@pytest.mark.parametrize(
    ("moved", "kidnapped"),
    [
        (SE2(0.45, 0.0, 0.3), False),
        (SE2(0.55, 0.0, 0.0), True),
        (SE2(0.0, 0.0, 0.4), True),
    ],
)
def test_a_kidnap_goes_farther_than_half_a_metre_or_20_degrees(
    moved: SE2, *, kidnapped: bool
) -> None:
    trial = judge_trial(timed(CALM, after("carry", stood(5.0, moved, moved))))
    assert trial.aftermaths[0].is_kidnap is kidnapped


def test_motion_that_odometry_measures_is_no_kidnap() -> None:
    trial = judge_trial(timed(CALM, after("teleport", stood(5.0, AWAY, AWAY, T_odom_base=AWAY))))
    assert not trial.aftermaths[0].is_kidnap


def test_a_slip_is_never_a_kidnap_but_has_an_aftermath() -> None:
    trial = judge_trial(timed(CALM, after("slip", stood(15.0, AWAY, AWAY))))
    (slip,) = trial.aftermaths
    assert not slip.is_kidnap
    assert slip.recovered_after_s == 0.0


@pytest.mark.parametrize(("late_s", "detected"), [(3.0, True), (3.5, False)])
def test_detected_is_within_3_s(late_s: float, *, detected: bool) -> None:
    misled = after("teleport", stood(late_s, AWAY, HOME))
    trial = judge_trial(timed(CALM, misled, stood(15.0, AWAY, None)))
    assert trial.aftermaths[0].is_detected is detected
    assert trial.aftermaths[0].left_after_s == pytest.approx(late_s)


def test_never_detected_and_never_recovered() -> None:
    trial = judge_trial(timed(CALM, after("teleport", stood(15.0, AWAY, HOME))))
    (kidnap,) = trial.aftermaths
    assert (kidnap.left_after_s, kidnap.recovered_after_s) == (None, None)
    assert not kidnap.is_detected


def test_only_useful_scans_count_towards_the_delay() -> None:
    blind = after("carry", stood(4.0, AWAY, HOME, useful=False))
    misled = stood(1.0, AWAY, HOME)
    dim = stood(6.0, AWAY, HOME, useful=False)
    trial = judge_trial(timed(CALM, blind, misled, dim, stood(15.0, AWAY, None)))
    (kidnap,) = trial.aftermaths
    assert kidnap.stamp == pytest.approx(19.0)
    assert kidnap.left_after_s == pytest.approx(1.0)
    assert kidnap.is_detected


def test_signalled_is_what_the_base_reports_while_it_happens() -> None:
    lifted = stood(2.0, HOME, None, disturbed=True, useful=False)
    signalled_scans = [replace(lifted[0], signalled=True), *lifted[1:]]
    set_down = after("carry", stood(15.0, AWAY, AWAY))
    for part, signalled in ((signalled_scans, True), (lifted, False)):
        (kidnap,) = judge_trial(timed(CALM, part, set_down)).aftermaths
        assert (kidnap.is_kidnap, kidnap.signalled) == (True, signalled)
        assert kidnap.left_after_s == 0.0


@pytest.mark.parametrize(
    ("right_s", "recovered"), [(9.5, False), (10.5, True)], ids=["too short", "long enough"]
)
def test_recovered_needs_10_s_before_the_next_disturbance(
    right_s: float, *, recovered: bool
) -> None:
    right = after("teleport", stood(right_s, AWAY, AWAY))
    trial = judge_trial(timed(CALM, right, after("teleport", stood(15.0, HOME, HOME))))
    assert (trial.aftermaths[0].recovered_after_s is not None) is recovered


def test_a_wrong_pose_restarts_the_10_s_of_a_recovery() -> None:
    wrong = stood(0.5, AWAY, SE2(5.0, 0.46, 0.0))
    right = stood(12.0, AWAY, SE2(5.0, 0.44, 0.0))
    trial = judge_trial(timed(CALM, after("teleport", right[:6]), wrong, right))
    assert trial.aftermaths[0].recovered_after_s == pytest.approx(3.5)


def test_where_the_truth_is_not_known_nothing_is_judged() -> None:
    unknown = [replace(i, truth=None) for i in found(stood(2.0, AWAY, HOME), HOME)]
    right = stood(4.0, AWAY, AWAY)
    trial = judge_trial(timed(CALM, after("teleport", right), unknown, right, right))
    assert trial.aftermaths[0].recovered_after_s == 0.0
    assert trial.wrong_fixes == ()


def test_wrong_fixes_are_those_beyond_45_cm_or_10_degrees() -> None:
    for fix, wrong in ((SE2(0.44, 0.0, 0.17), 0), (SE2(0.46, 0.0, 0.0), 1), (SE2(0, 0, 0.18), 1)):
        trial = judge_trial(timed(found(stood(2.0, HOME, fix), fix)))
        assert len(trial.wrong_fixes) == wrong
        assert trial.first_fix is (wrong == 0)


def test_without_a_fix_the_start_is_neither_right_nor_wrong() -> None:
    late = found(stood(15.0, AWAY, AWAY), AWAY)
    trial = judge_trial(timed(stood(5.0, HOME, None), after("teleport", late)))
    assert trial.first_fix is None
    assert not trial.aftermaths[0].known_before


def alarmed(trial: Trial) -> int:
    return len(trial.alarms)


def test_giving_up_or_replacing_the_pose_in_calm_is_a_false_alarm() -> None:
    given_up = judge_trial(timed(CALM, stood(1.0, HOME, None), found(CALM, HOME)))
    assert alarmed(given_up) == 1  # being found after it is part of it
    anew = judge_trial(timed(CALM, found(CALM, HOME)))
    assert alarmed(anew) == 1
    assert alarmed(judge_trial(timed(CALM, CALM[1:]))) == 0


def test_a_better_pose_within_the_10_s_belongs_to_the_recovery() -> None:
    near = after("slip", stood(2.0, AWAY, SE2(5.3, 0.0, 0.0)))
    trial = judge_trial(timed(CALM, near, found(stood(15.0, AWAY, AWAY), AWAY)))
    assert alarmed(trial) == 0


def test_giving_up_a_track_that_is_wrong_is_no_false_alarm_but_it_went_astray() -> None:
    astray = stood(2.0, HOME, SE2(0.6, 0.0, 0.0))
    trial = judge_trial(timed(CALM, astray, stood(1.0, HOME, None), found(CALM, HOME)))
    assert alarmed(trial) == 0
    assert trial.strays == (30,)


def test_a_disturbance_or_a_robot_not_found_is_not_calm() -> None:
    lost = judge_trial(timed(stood(15.0, HOME, None), stood(5.0, HOME, HOME), stood(1, HOME, None)))
    assert (lost.alarms, lost.calm_s) == ((), 0.0)
    taken = judge_trial(timed(CALM, after("teleport", stood(5.0, AWAY, None))))
    assert taken.alarms == ()


def test_calm_begins_when_the_recovery_is_proven_and_ends_with_a_disturbance() -> None:
    lifted = stood(5.0, HOME, None, disturbed=True)
    trial = judge_trial(timed(CALM, lifted, after("carry", stood(13.0, AWAY, AWAY))))
    assert trial.calm_s == pytest.approx(4.5 + 2.5)
    assert trial.duration_s == pytest.approx(32.5)


def test_a_scenario_may_end_while_something_is_being_done() -> None:
    trial = judge_trial(timed(CALM, stood(5.0, HOME, None, disturbed=True, useful=False)))
    assert trial.aftermaths == ()
    assert judge_trial(timed(stood(1.0, HOME, None, useful=False))).start is None
