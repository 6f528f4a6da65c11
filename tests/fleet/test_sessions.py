"""Which robots are remembered."""

from __future__ import annotations

from firstfix.fleet.sessions import Sessions


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_silent_robots_are_forgotten() -> None:
    clock = Clock()
    sessions = Sessions(2, idle_s=10.0, clock=clock)
    first = sessions.report("a")
    clock.now += 6.0
    sessions.report("b")
    assert sessions.report("a") is first
    clock.now += 5.0
    assert sessions.report("b")
    clock.now += 6.0
    assert sessions.names() == ["b"]
    assert sessions.find("a") is None
    sessions.report("c")
    assert sessions.forget("c")
    assert not sessions.forget("c")
    assert len(sessions) == 1


def test_a_new_robot_takes_the_place_of_the_one_that_was_silent_for_longest() -> None:
    sessions = Sessions(2, idle_s=10.0, clock=Clock())
    for name in ("a", "b", "a", "c"):
        sessions.report(name)
    assert sessions.names() == ["a", "c"]
