"""Processes: results in order, errors passed on, killed ones reported, none left running."""

import math
import multiprocessing
import operator
import os
import time
from functools import partial

import pytest

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.lab.experiments.process_pool import peak_rss_mb, run_in_processes


def ignore(index: int, result: object) -> None:
    pass


def test_results_keep_the_order_of_the_tasks_whatever_ends_first() -> None:
    ended: list[tuple[int, float]] = []
    tasks = [partial(math.sqrt, x * x) for x in (3.0, 2.0, 1.0)]
    assert run_in_processes(tasks, 2, lambda i, x: ended.append((i, x))) == [3.0, 2.0, 1.0]
    assert sorted(ended) == [(0, 3.0), (1, 2.0), (2, 1.0)]


def test_every_task_has_a_process_of_its_own() -> None:
    ids = run_in_processes([os.getpid] * 2, 1, ignore)
    assert len({*ids, os.getpid()}) == 3


def test_what_a_task_raises_comes_home_and_the_others_end() -> None:
    start = time.monotonic()
    with pytest.raises(InputError, match="finite numbers"):
        run_in_processes([partial(time.sleep, 60.0), partial(SE2, math.nan, 0.0, 0.0)], 2, ignore)
    assert time.monotonic() - start < 30.0
    assert multiprocessing.active_children() == []


def test_a_killed_process_is_an_error_not_a_wait() -> None:
    with pytest.raises(InputError, match="exit status 9"):
        run_in_processes([partial(os._exit, 9)], 1, ignore)


def test_an_interruption_leaves_no_process_behind() -> None:
    def interrupt(index: int, result: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_in_processes([partial(math.sqrt, 4.0), partial(time.sleep, 60.0)], 2, interrupt)
    assert multiprocessing.active_children() == []


def test_nothing_to_do_is_done() -> None:
    assert run_in_processes([], 4, ignore) == []


def test_a_child_does_not_inherit_its_parents_peak() -> None:
    ballast = bytearray(os.urandom(1)) * 400_000_000
    own = peak_rss_mb()
    (childs,) = run_in_processes([peak_rss_mb], 1, ignore)
    assert own is not None
    assert childs is not None
    assert own > 400.0
    assert operator.truth(ballast)
    assert childs < 300.0
