"""The figures of the demo, each with an episode in which it counts and one in which it does not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.demo import DemoStep, Episode, summarize_episodes

HERE, ELSEWHERE = SE2(1.0, 2.0, 0.5), SE2(7.0, 2.0, 0.5)


def step(stamp: float, published: SE2 | None = HERE, **changes: object) -> DemoStep:
    usual = DemoStep(stamp, HERE, published, None, 0, False, 0.001)
    return replace(usual, **changes)  # type: ignore[arg-type]


def one_episode(*steps: DemoStep) -> Episode:
    (episode,) = summarize_episodes(steps)
    return episode


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
    assert step(0.0, HERE @ off).is_right is right


def test_a_robot_that_is_found_at_once_and_tracked() -> None:
    episode = one_episode(step(3.0, initial=HERE), step(3.1), step(3.2, HERE @ SE2(0.1, 0.0, 0.0)))
    assert (episode.began_s, episode.noticed_s, episode.found_s, episode.wrong_finds) == (
        3.0,
        0.0,
        0.0,
        0,
    )
    assert episode.kept == 1.0
    assert episode.rmse_m == pytest.approx(0.1 / math.sqrt(3))
    assert episode.is_tracked


def test_a_kidnap_is_noticed_when_the_old_pose_is_given_up() -> None:
    steps = [step(0.0, ELSEWHERE), step(0.1, ELSEWHERE), step(0.2, None), step(0.5)]
    episode = one_episode(*steps)
    assert episode.noticed_s == pytest.approx(0.2)
    assert episode.found_s == pytest.approx(0.5)


def test_what_is_never_noticed_and_never_found() -> None:
    episode = one_episode(step(0.0, ELSEWHERE), step(0.1, ELSEWHERE))
    assert (episode.noticed_s, episode.found_s) == (None, None)
    assert math.isnan(episode.kept)
    assert not episode.is_tracked


def test_to_be_found_where_one_is_not_is_no_success() -> None:
    steps = [step(0.0, ELSEWHERE, initial=ELSEWHERE), *(step(0.1 * i) for i in range(1, 300))]
    episode = one_episode(*steps)
    assert episode.wrong_finds == 1
    assert not episode.is_tracked


def test_to_be_found_and_lost_again_is_none_either() -> None:
    episode = one_episode(step(0.0), step(0.1), step(0.2, ELSEWHERE), step(0.3, None))
    assert episode.kept == 0.5
    assert not episode.is_tracked


def test_time_counts_from_when_the_robot_stands_again() -> None:
    carried = [step(0.1 * i, None, lifted=True) for i in range(40)]
    episode = one_episode(*carried, step(4.0, None), step(4.1))
    assert episode.began_s == 4.0
    assert episode.found_s == pytest.approx(0.1)


def test_episodes_are_separated() -> None:
    episodes = summarize_episodes(
        [step(0.0), step(0.1, episode=1), step(0.2, ELSEWHERE, episode=2)]
    )
    assert [episode.found_s for episode in episodes] == [0.0, 0.0, None]


@pytest.mark.parametrize(
    ("shares", "truth_at", "published", "equal"),
    [
        ((0.25, 0.25, 0.25, 0.25), 2, None, 4),
        ((0.6, 0.35, 0.05), 1, None, 2),
        ((0.6, 0.35, 0.05), 2, None, 0),
        ((0.5, 0.5), 1, ELSEWHERE, 0),
        ((0.9, 0.1), 0, None, 1),
    ],
)
def test_no_pose_is_correct_only_if_the_true_place_is_one_of_several_equal_ones(
    answer: Any, shares: tuple[float, ...], truth_at: int, published: SE2 | None, equal: int
) -> None:
    poses = [SE2(3.0 * i, 2.0, 0.5) for i in range(len(shares))]
    places = tuple(
        replace(place, probability=share)
        for place, share in zip(answer(*poses).hypotheses, shares, strict=True)
    )
    steps = [step(0.0, published), step(0.1, None, places=places)]
    episode = one_episode(*(replace(s, truth=poses[truth_at]) for s in steps))
    assert len(episode.equal_places) == equal
    assert episode.is_correctly_ambiguous is (equal > 1)
    assert not episode.is_tracked
