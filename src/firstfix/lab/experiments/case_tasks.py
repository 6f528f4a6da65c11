"""Methods over cases, in parallel where asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from firstfix.global_localization.config import Method
from firstfix.lab.experiments.case import Case, next_elsewhere
from firstfix.lab.experiments.case_runs import CaseRun, ForeignRun, run_case, run_foreign
from firstfix.lab.experiments.process_pool import run_apart


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
class ForeignTask:
    """Try scans of a case in another building; ``limit`` of them, evenly spaced (0: all)."""

    case: Case
    on: Case
    method: Method
    limit: int = 0

    def __call__(self) -> ForeignRun:
        """Run in this process."""
        return run_foreign(self.case, self.on, self.method, self.limit)


def case_tasks(cases: Sequence[Case], methods: Sequence[Method], limit: int) -> list[CaseTask]:
    """List every case with every method."""
    return [CaseTask(case, method, limit) for method in methods for case in cases]


def foreign_tasks(
    cases: Sequence[Case], methods: Sequence[Method], limit: int
) -> list[ForeignTask]:
    """List every case with the next one that is another building, with every method."""
    pairs = [(case, next_elsewhere(list(cases), i)) for i, case in enumerate(cases)]
    return [
        ForeignTask(case, on, method, limit)
        for method in methods
        for case, on in pairs
        if on is not None
    ]


def run_tasks(
    tasks: Sequence[CaseTask | ForeignTask],
    jobs: int,
    on_done: Callable[[CaseRun | ForeignRun], None],
) -> list[CaseRun | ForeignRun]:
    """Run tasks, each in a process of its own.

    Parameters
    ----------
    tasks : sequence of CaseTask or ForeignTask
        What to run.
    jobs : int
        How many processes at a time; more than one makes wall times longer, processor times not.
    on_done : callable
        Is told each result as it comes.

    Returns
    -------
    list of CaseRun or ForeignRun
        In the order of the tasks.

    Raises
    ------
    InputError
        If a case cannot be loaded or has no truth.
    """
    return run_apart(tasks, jobs, lambda _, run: on_done(run))
