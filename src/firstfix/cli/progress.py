"""Progress of long work: a bar on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

_LINE_S = 10.0
"""Time between two lines where there is no terminal, s: short work prints none."""


@contextmanager
def working(title: str) -> Iterator[None]:
    """Show that something is going on, on stderr."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(title):
        yield


@contextmanager
def progress(
    total: int, title: str, clock: Callable[[], float] = time.monotonic
) -> Iterator[Callable[[str], None]]:
    """Show the progress of ``total`` steps on stderr; yields a callback for the end of a step."""
    if total < 2:
        yield lambda _: None
        return
    if not sys.stderr.isatty():
        yield _lines(total, title, clock)
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn(title),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, advance=1, description=done)


@contextmanager
def progress_of_start(total: int, title: str) -> Iterator[Callable[[str], None]]:
    """Show the progress of ``total`` steps, as `progress`, until the last; then work goes on."""
    left = total
    with ExitStack() as shown:
        step = shown.enter_context(progress(total, title))

        def done(name: str) -> None:
            nonlocal left
            left -= 1
            step(name)
            if left == 0:
                shown.close()

        yield done


def _lines(total: int, title: str, clock: Callable[[], float]) -> Callable[[str], None]:
    count, last = 0, clock()

    def done(name: str) -> None:
        nonlocal count, last
        count += 1
        if clock() - last >= _LINE_S:
            last = clock()
            sys.stderr.write(f"{title}: {count} of {total} ({name})\n")

    return done
