"""Methods over cases, in parallel where asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from firstfix.global_localization.config import Method
from firstfix.lab.experiments.case import Case, next_elsewhere
from firstfix.lab.experiments.case_runs import CaseRun, WrongMapRun, run_case, run_wrong_map
from firstfix.lab.experiments.process_pool import run_in_processes


@dataclass(frozen=True, slots=True)
class CaseTask:
    """Try a case; ``limit`` scans of it, evenly spaced (0: all)."""

    case: Case
    method: Method
    limit: int = 0

    def __call__(self) -> CaseRun:
        """Run in this process."""
        return run_case(self.case, self.method, self.limit)


@dataclass(frozen=True, slots=True)
class WrongMapTask:
    """Try scans of a case in another building; ``limit`` of them, evenly spaced (0: all)."""

    case: Case
    on: Case
    method: Method
    limit: int = 0

    def __call__(self) -> WrongMapRun:
        """Run in this process."""
        return run_wrong_map(self.case, self.on, self.method, self.limit)


def case_tasks(cases: Sequence[Case], methods: Sequence[Method], limit: int) -> list[CaseTask]:
    """List every case with every method."""
    return [CaseTask(case, method, limit) for method in methods for case in cases]


def wrong_map_tasks(
    cases: Sequence[Case], methods: Sequence[Method], limit: int
) -> list[WrongMapTask]:
    """List every case with the next one that is another building, with every method."""
    pairs = [(case, next_elsewhere(list(cases), i)) for i, case in enumerate(cases)]
    return [
        WrongMapTask(case, on, method, limit)
        for method in methods
        for case, on in pairs
        if on is not None
    ]


def run_tasks(
    tasks: Sequence[CaseTask | WrongMapTask],
    jobs: int,
    on_done: Callable[[CaseRun | WrongMapRun], None],
) -> list[CaseRun | WrongMapRun]:
    """Run tasks, each in a process of its own.

    Parameters
    ----------
    tasks : sequence of CaseTask or WrongMapTask
        What to run.
    jobs : int
        How many processes at a time; more than one makes wall times longer, processor times not.
    on_done : callable
        Is told each result as it comes.

    Returns
    -------
    list of CaseRun or WrongMapRun
        In the order of the tasks.

    Raises
    ------
    InputError
        If a case cannot be loaded or has no truth.
    """
    return run_in_processes(tasks, jobs, lambda _, run: on_done(run))
