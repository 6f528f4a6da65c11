"""Clients are limited in rate, and wrong tokens cost more."""

from __future__ import annotations

import time

from firstfix.web.rate_limiter import RateLimiter


def test_a_client_is_limited_in_burst_and_rate():
    now = [0.0]
    limiter = RateLimiter(rate_hz=2.0, burst=3.0, clock=lambda: now[0])
    assert [limiter.admits("a") for _ in range(4)] == [True, True, True, False]
    assert limiter.admits("b")
    now[0] = 0.6
    assert [limiter.admits("a") for _ in range(2)] == [True, False]
    now[0] = 100.0
    assert [limiter.admits("a") for _ in range(4)] == [True, True, True, False]


def test_a_charge_delays_the_client():
    now = [0.0]
    limiter = RateLimiter(rate_hz=2.0, burst=3.0, clock=lambda: now[0])
    limiter.charge("a", 5.0)
    now[0] = 1.4
    assert not limiter.admits("a")
    now[0] = 1.6
    assert limiter.admits("a")


def test_the_number_of_remembered_clients_is_bounded():
    limiter = RateLimiter(clock=time.monotonic)
    for i in range(5000):
        assert limiter.admits(f"{i}")
    assert len(limiter._buckets) <= 1024
