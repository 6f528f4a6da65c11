"""What all benchmarks have in common: independent tasks, and a summary of their results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firstfix.lab.experiments.process_pool import run_in_processes


@dataclass(frozen=True, slots=True)
class Summary:
    """The result of a benchmark.

    Parameters
    ----------
    document : dict
        All figures, ready for JSON; `docs/json.md` describes it.
    tables : tuple of str
        The main figures in Markdown.
    notes : tuple of str
        What was left out and why.
    write_report : callable or None
        Writes a report into a folder and returns its page; None if the benchmark has no report.
    """

    document: dict[str, Any]
    tables: tuple[str, ...]
    notes: tuple[str, ...] = ()
    write_report: Callable[[Path], Path] | None = None


@dataclass(frozen=True, slots=True)
class Benchmark:
    """Tasks to run, each in a new process, and the summary of their results.

    Parameters
    ----------
    tasks : sequence of callable
        Picklable, as are their results.
    names : sequence of str
        One for each task, to show progress.
    summarize : callable
        Takes the results in the order of the tasks.
    first : int
        Number of tasks that have to end before the others begin.
    """

    tasks: Sequence[Callable[[], Any]]
    names: Sequence[str]
    summarize: Callable[[list[Any]], Summary]
    first: int = 0

    def run(self, jobs: int, on_done: Callable[[str], None]) -> Summary:
        """Run the tasks, ``jobs`` at a time; ``on_done`` takes the name of each that has ended.

        Raises
        ------
        InputError
            If a task fails because of its input, or nothing could be measured.
        """
        before = run_in_processes(
            self.tasks[: self.first], jobs, lambda i, _: on_done(self.names[i])
        )
        rest = run_in_processes(
            self.tasks[self.first :], jobs, lambda i, _: on_done(self.names[self.first + i])
        )
        return self.summarize([*before, *rest])
