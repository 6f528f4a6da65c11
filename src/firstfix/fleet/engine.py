"""The interface between the service and what runs its workers."""

from __future__ import annotations

from typing import Protocol, TypeVar

from firstfix.fleet.jobs import Done, Job

T = TypeVar("T")


class WorkerLostError(Exception):
    """A worker ended before it had answered. The engine starts another one."""


class Engine(Protocol):
    """Runs one worker for each shard of a site."""

    async def ask(self, worker: int, job: Job[T]) -> Done[T]:
        """Let a worker do a job.

        Parameters
        ----------
        worker : int
            Number of the shard.
        job : Job
            What to do.

        Raises
        ------
        WorkerLostError
            If the worker ended before it had answered; the job may be asked again.
        InputError
            If the query cannot be answered.
        """
        ...

    def close(self) -> None:
        """End all workers."""
        ...
