"""What is remembered of robots."""

from __future__ import annotations

import pytest
from fleet_lab import scan_of

from firstfix.core.se2 import SE2
from firstfix.fleet.sessions import VIEWS, RobotView, Sessions, TooManyRobotsError, with_view

SCAN = scan_of("first", SE2(2.3, 2.1, 0.0))


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def drive(*odometry: SE2) -> list[SE2]:
    views: tuple[RobotView, ...] = ()
    for pose in odometry:
        views = with_view(views, RobotView((SCAN,), pose))
    return [view.T_odom_base for view in views]


def test_the_last_views_that_brought_news_are_kept() -> None:
    along = [SE2(0.5 * i, 0.0, 0.0) for i in range(VIEWS + 2)]
    assert drive(*along) == along[-VIEWS:]
    turns = [SE2(0.0, 0.0, 0.5 * i) for i in range(3)]
    assert drive(*turns) == turns


def test_a_robot_that_stands_still_fills_no_window() -> None:
    start, end = SE2(0.0, 0.0, 0.0), SE2(1.0, 0.0, 0.0)
    assert drive(start, *[end] * 10) == [start, end, end]
    assert drive(*[start] * 10) == [start, start]


def test_a_jump_of_the_odometry_starts_anew() -> None:
    assert drive(SE2(0.0, 0.0, 0.0), SE2(1.0, 0.0, 0.0), SE2(50.0, 0.0, 0.0)) == [
        SE2(50.0, 0.0, 0.0)
    ]


def test_silent_robots_are_forgotten_and_make_room() -> None:
    clock = Clock()
    sessions = Sessions(2, idle_s=10.0, clock=clock)
    first = sessions.report("a")
    clock.now += 6.0
    sessions.report("b")
    assert sessions.report("a") is first
    with pytest.raises(TooManyRobotsError):
        sessions.report("c")
    clock.now += 5.0
    assert sessions.report("b")
    clock.now += 6.0
    assert sessions.names() == ["b"]
    assert sessions.find("a") is None
    sessions.report("c")
    assert sessions.forget("c")
    assert not sessions.forget("c")
    assert len(sessions) == 1
