"""Each task in a process of its own.

A process counts its peak memory from birth, so a case's peak is known only if nothing ran before
it in its process. Processes are spawned, not forked: no thread or lock of the parent comes along.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, TypeVar

from firstfix.core.errors import InputError

T = TypeVar("T")


def run_in_processes(
    tasks: Sequence[Callable[[], T]], jobs: int, on_done: Callable[[int, T], None]
) -> list[T]:
    """Run tasks, each in a new process, and stop at the first that fails.

    Parameters
    ----------
    tasks : sequence of callable
        Picklable, as are their results.
    jobs : int
        Processes at a time.
    on_done : callable
        Takes index and result of each task when it ends.

    Returns
    -------
    list
        Results in the order of the tasks.

    Raises
    ------
    InputError
        If a process was killed. An exception of a task is raised here.
    """
    context = multiprocessing.get_context("spawn")
    waiting = deque(enumerate(tasks))
    running: dict[Connection, tuple[int, SpawnProcess]] = {}
    results: dict[int, T] = {}
    try:
        while waiting or running:
            while waiting and len(running) < max(1, jobs):
                i, task = waiting.popleft()
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(target=_run, args=(task, sender), daemon=True)
                process.start()
                sender.close()  # else the end of the child would not end the pipe
                running[receiver] = (i, process)
            ended = wait(list(running))
            for receiver in [known for known in running if known in ended]:
                i, process = running.pop(receiver)
                results[i] = _receive(receiver, process)
                on_done(i, results[i])
    finally:
        for _, process in running.values():
            process.terminate()
            process.join()
    return [results[i] for i in range(len(tasks))]


def peak_rss_mb() -> float | None:
    """Return the peak of this process's resident memory so far, MB; None where unknown."""
    # Linux's ru_maxrss is handed down through fork and exec: a child of a large parent would report
    # the parent's. VmHWM belongs to the new address space alone.
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024 / 1e6
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6  # macOS counts bytes


def _run(task: Callable[[], Any], sender: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's; it ends its children
    try:
        outcome: tuple[Any, Exception | None] = (task(), None)
    except Exception as error:  # noqa: BLE001 - sent home and raised there
        outcome = (None, error)
    sender.send(outcome)


def _receive(receiver: Connection, process: SpawnProcess) -> Any:
    try:
        with receiver:
            result, error = receiver.recv()
    except EOFError:
        process.join()
        raise InputError(
            expected="every case to come to its end",
            received=f"the end of its process (exit status {process.exitcode})",
            remedy="run fewer --jobs at a time, or free some memory",
        ) from None
    process.join()
    if error is not None:
        raise error
    return result
