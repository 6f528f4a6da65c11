"""Workers that are processes of this machine.

They map the same prepared files into memory, so the maps are in memory once.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait
from typing import TypeVar

from firstfix.fleet.engine import WorkerLostError
from firstfix.fleet.jobs import Done, Job, ShardedSite, run_job
from firstfix.site.site import Site

T = TypeVar("T")


class LocalEngine:
    """One process for each shard.

    Parameters
    ----------
    sharded : ShardedSite
        The maps of each worker.
    """

    def __init__(self, sharded: ShardedSite) -> None:
        self._sharded = sharded
        self._workers = [self._start(i) for i in range(len(sharded.shards))]

    async def ask(self, worker: int, job: Job[T]) -> Done[T]:
        """Let a worker do a job (`Engine.ask`)."""
        process = self._workers[worker]
        try:
            return await asyncio.wrap_future(process.submit(_run, job))
        except BrokenProcessPool as error:
            # Everyone who waited for it comes here, and the first one replaces it.
            if self._workers[worker] is process:
                process.shutdown(wait=False)
                self._workers[worker] = self._start(worker)
            raise WorkerLostError from error

    def close(self) -> None:
        """End all workers."""
        for process in self._workers:
            process.shutdown(wait=False, cancel_futures=True)

    def _start(self, worker: int) -> ProcessPoolExecutor:
        # A fork would copy locks that other threads of this process hold.
        return ProcessPoolExecutor(
            max_workers=1,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_open,
            initargs=(self._sharded, worker),
        )


_sites: list[Site] = []
"""The part of the site that this process has."""


def _open(sharded: ShardedSite, worker: int) -> None:
    # Ctrl-C goes to the whole group; the service ends its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _sites[:] = [sharded.open(worker)]


def _run(job: Job[T]) -> Done[T]:
    return run_job(job, _sites[0])


def _end_with_parent() -> None:
    """End this process if the service was killed and cannot end it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
