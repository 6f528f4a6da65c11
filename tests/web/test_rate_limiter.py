"""Who asks too much, or guesses, is kept waiting."""

from __future__ import annotations

import time

from firstfix.web.rate_limiter import RateLimiter


def test_the_end_of_an_allowance():
    now = [0.0]
    allowance = RateLimiter(rate_hz=2.0, burst=3.0, clock=lambda: now[0])
    assert [allowance.takes("a") for _ in range(4)] == [True, True, True, False]
    assert allowance.takes("b")
    now[0] = 0.6
    assert [allowance.takes("a") for _ in range(2)] == [True, False]
    now[0] = 100.0
    assert [allowance.takes("a") for _ in range(4)] == [True, True, True, False]


def test_what_was_charged_has_to_be_waited_for():
    now = [0.0]
    allowance = RateLimiter(rate_hz=2.0, burst=3.0, clock=lambda: now[0])
    allowance.charge("a", 5.0)
    now[0] = 1.4
    assert not allowance.takes("a")
    now[0] = 1.6
    assert allowance.takes("a")


def test_a_flood_of_clients_is_forgotten():
    allowance = RateLimiter(clock=time.monotonic)
    for i in range(5000):
        assert allowance.takes(f"{i}")
    assert len(allowance._left) <= 1024
