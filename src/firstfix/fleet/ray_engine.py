"""Workers that are actors of a Ray cluster."""

from __future__ import annotations

import os
import socket
from collections.abc import Awaitable
from typing import TypeVar

# Ray reads it when it is imported: firstfix tells nobody that it is used.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")

import ray
from ray.exceptions import RayError, RayTaskError

from firstfix.core.errors import FirstfixError, InputError
from firstfix.fleet.engine import WorkerLostError
from firstfix.fleet.jobs import Done, Job, ShardedSite, run_job

T = TypeVar("T")

_CONNECT_S = 5.0


class ShardActor:
    """The maps of one worker, in a process of the cluster.

    Parameters
    ----------
    sharded : ShardedSite
        The maps of each worker.
    worker : int
        Which of them this is.
    """

    def __init__(self, sharded: ShardedSite, worker: int) -> None:
        self._site = sharded.open(worker)

    def run(self, job: Job[T]) -> Done[T]:
        """Do a job."""
        return run_job(job, self._site)


class RayEngine:
    """One actor for each shard. Ray starts an actor that is lost again, on another node if need be.

    Parameters
    ----------
    sharded : ShardedSite
        The maps of each worker, at the same path on all nodes.
    address : str or None
        Of a running cluster; None takes the one that this process belongs to, or else starts one
        on this machine.

    Raises
    ------
    InputError
        If the cluster does not answer.
    """

    def __init__(self, sharded: ShardedSite, address: str | None) -> None:
        self._is_guest = ray.is_initialized()
        if not self._is_guest:
            _connect(address, len(sharded.shards))
        actor = ray.remote(num_cpus=1, max_restarts=-1, scheduling_strategy="SPREAD")(ShardActor)
        self._actors = [actor.remote(sharded, i) for i in range(len(sharded.shards))]

    async def ask(self, worker: int, job: Job[T]) -> Done[T]:
        """Let a worker do a job (`Engine.ask`)."""
        return await answer_of(self._actors[worker].run.remote(job))

    def close(self) -> None:
        """End all actors, and leave the cluster, or end it if it was started here."""
        for actor in self._actors:
            ray.kill(actor)
        self._actors = []
        if not self._is_guest:
            ray.shutdown()


async def answer_of(running: Awaitable[Done[T]]) -> Done[T]:
    """Wait for a job in the cluster.

    Raises
    ------
    WorkerLostError
        If its process ended.
    InputError
        If the query cannot be answered.
    """
    try:
        return await running
    except RayTaskError as error:
        if isinstance(error.cause, FirstfixError):
            raise error.cause from None
        raise
    except RayError as error:
        raise WorkerLostError from error


def _connect(address: str | None, workers: int) -> None:
    if address is None:
        ray.init(
            "local",
            num_cpus=workers,
            include_dashboard=False,
            log_to_driver=False,
            logging_level="warning",
            _node_ip_address="127.0.0.1",
        )
        return
    try:
        _check_reachable(address)
        ray.init(address, log_to_driver=False, logging_level="warning")
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(
            f"The Ray cluster at {address!r:.100} does not answer. Start it (ray start --head), or "
            "leave --ray-address out."
        ) from error


def _check_reachable(address: str) -> None:
    """Raise OSError if nothing listens there: Ray itself would try for a minute."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if host and port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), _CONNECT_S).close()
