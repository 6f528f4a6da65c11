"""A log of a drive."""

import numpy as np
import pytest

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan

SCAN = LaserScan(np.ones(3), -0.1, 0.1, 0.0, 10.0)


def test_a_recording_is_as_long_as_its_scans() -> None:
    recording = Recording((SCAN, SCAN), truth=np.zeros((2, 3)), runs=np.zeros(2, np.int64))
    assert len(recording) == 2


def test_an_empty_log_is_refused() -> None:
    with pytest.raises(ScanError, match="at least one scan"):
        Recording(())


def test_truth_must_fit_the_scans() -> None:
    with pytest.raises(ScanError, match=r"truth of shape \(1, 3\)"):
        Recording((SCAN,), truth=np.zeros((2, 3)))


def test_runs_must_fit_the_scans() -> None:
    with pytest.raises(ScanError, match=r"runs of shape \(1,\)"):
        Recording((SCAN,), runs=np.zeros(3, np.int64))
