"""Figures of the service for Prometheus."""

from __future__ import annotations

import time
from collections.abc import Iterator

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.process_collector import ProcessCollector
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from firstfix.fleet.service import Service

_BOUNDS_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0)


class Metrics:
    """ASGI middleware that counts requests, and the text that Prometheus reads.

    Parameters
    ----------
    app : ASGI application
        What is counted.
    registry : CollectorRegistry
        Where the figures are kept.
    """

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        self._requests = Counter(
            "firstfix_requests", "Requests.", ["endpoint", "status"], registry=registry
        )
        self._latency = Histogram(
            "firstfix_latency_seconds",
            "Time of a request.",
            ["endpoint"],
            buckets=_BOUNDS_S,
            registry=registry,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started, statuses = time.perf_counter(), ["none"]

        async def send_counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                statuses[0] = str(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, send_counted)
        finally:
            # Starlette writes the handler of the route into the scope.
            endpoint = getattr(scope.get("endpoint"), "__name__", "other")
            self._requests.labels(endpoint, statuses[0]).inc()
            self._latency.labels(endpoint).observe(time.perf_counter() - started)


def new_registry(service: Service) -> CollectorRegistry:
    """Make a registry that describes a service and its process."""
    registry = CollectorRegistry()
    registry.register(_ServiceCollector(service))
    ProcessCollector(registry=registry)
    return registry


def as_text(registry: CollectorRegistry) -> bytes:
    """Write all figures in the format of Prometheus."""
    return generate_latest(registry)


class _ServiceCollector(Collector):
    """Reads the figures of the service when they are asked for."""

    def __init__(self, service: Service) -> None:
        self._service = service

    def collect(self) -> Iterator[Metric]:
        """Return all figures."""
        service, fleet = self._service, self._service.fleet
        maps = GaugeMetricFamily("firstfix_maps", "Maps by state.", labels=["state"])
        counted = {"prepared": len(fleet.prepared), "unusable": len(fleet.faults)}
        counted["waiting"] = len(fleet.map_ids) - sum(counted.values())
        for state, number in counted.items():
            maps.add_metric([state], number)
        yield maps
        verdicts = CounterMetricFamily("firstfix_verdicts", "Verdicts.", labels=["verdict"])
        for verdict, number in service.verdicts.items():
            verdicts.add_metric([verdict], number)
        yield verdicts
        memory = GaugeMetricFamily(
            "firstfix_worker_memory_bytes",
            "Resident memory of a worker, with the maps that workers share.",
            labels=["worker"],
        )
        for worker, size in fleet.memory.items():
            memory.add_metric([str(worker)], size)
        yield memory
        cpu = CounterMetricFamily(
            "firstfix_worker_cpu_seconds", "Processor time of a worker.", labels=["worker"]
        )
        for worker, seconds in fleet.cpu_s.items():
            cpu.add_metric([str(worker)], seconds)
        yield cpu
        for name, text, value in (
            ("firstfix_queue", "Queries that run or wait.", service.waiting),
            ("firstfix_robots", "Robots that are remembered.", len(service.sessions)),
        ):
            yield GaugeMetricFamily(name, text, value=value)
        yield CounterMetricFamily(
            "firstfix_lost_jobs", "Jobs that were lost with their worker.", value=fleet.lost_jobs
        )
