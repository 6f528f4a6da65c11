"""Real parts for the adapters, a ROS 1 master and DDS; skipped with a reason where missing."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))

import dds_lab
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
