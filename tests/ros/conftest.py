"""Real parts for the adapters, a ROS 1 master and DDS; skipped with a reason where missing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))

import dds_lab
from node_lab import Converter, Running
from recorder import Recorder
from required import missing
from ros1_lab import Lab, why_missing


@pytest.fixture
def ros1(tmp_path: Path) -> Iterator[Lab]:
    """Give a ROS 1 whose master runs."""
    if why := why_missing():
        missing("ros1", why)
    lab = Lab(tmp_path)
    lab.master.start()
    yield lab
    lab.end()


@pytest.fixture
def dds(tmp_path: Path) -> Iterator[dds_lab.Lab]:
    """Give a domain of DDS on the loopback interface."""
    if why := dds_lab.why_missing():
        missing("dds", why)
    lab = dds_lab.Lab(tmp_path)
    yield lab
    lab.end()


@pytest.fixture
def recorder(ros2: Any) -> Recorder:
    """Give a transport that keeps what is published, with messages of ROS 2."""
    return Recorder(ros2)


@pytest.fixture
def run(recorder: Recorder) -> Iterator[Callable[..., Running]]:
    """Give a function that makes a node; all are stopped at the end."""
    made: list[Running] = []

    def run(to: Recorder | None = None, *, start: bool = True, **parameters: Any) -> Running:
        made.append(Running(to or recorder, **parameters))
        if start:
            made[-1].node.start()
        return made[-1]

    yield run
    for each in made:
        each.node.stop()


@pytest.fixture
def converter() -> Converter:
    """Give a message converter with the default parameters."""
    return Converter()
