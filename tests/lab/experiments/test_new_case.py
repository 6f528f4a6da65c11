"""Cases made of a map, a log and true poses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.errors import InputError, ScanError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.core.trajectory import Trajectory
from firstfix.lab.experiments.case import find_cases, known_truth
from firstfix.lab.experiments.new_case import with_truth, write_case


@pytest.fixture
def five(cross: LaserScan) -> Recording:
    """Scans at 0, 0.2, ... 0.8 s of a sensor 0.3 m before the base."""
    return Recording(
        tuple(replace(cross, stamp=0.2 * i, T_base_laser=SE2(0.3, 0.0, 0.0)) for i in range(5))
    )


def test_truth_is_interpolated_within_short_gaps_only(five: Recording) -> None:
    poses = Trajectory([0.0, 0.4, 2.0], [[0, 0, 0], [4.0, 0, 0], [9.0, 0, 0]])
    recording, known = with_truth(five, poses)
    assert known == 3
    assert recording.truth[:3, 0] == pytest.approx([0.0, 2.0, 4.0])
    assert np.isnan(recording.truth[3:]).all()


def test_a_case_is_read_back(five: Recording, hall: OccupancyGrid, tmp_path: Path) -> None:
    poses = Trajectory([0.0, 0.5, 1.0], [[1.0, 2.0, 0.5], [2.0, 2.0, 0.5], [3.0, 2.0, 0.5]])
    recording, _ = with_truth(five, poses)
    write_case(hall, recording, tmp_path / "new" / "lab_3", site="lab", kind="real")
    (case,) = find_cases([tmp_path / "new"])
    assert (case.name, case.site, case.kind) == ("lab_3", "lab", "real")
    read = case.recording()
    assert known_truth(case, read) == pytest.approx(recording.truth)
    assert read.scans[0].T_base_laser.x == pytest.approx(0.3)
    assert np.array_equal(case.grid().cells, hall.cells)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["lab_3"]


def test_nothing_is_left_of_a_case_that_cannot_be_written(
    five: Recording, hall: OccupancyGrid, tmp_path: Path
) -> None:
    other = replace(five.scans[1], range_max=5.0)
    mixed = replace(five, scans=(five.scans[0], other), truth=np.zeros((2, 3)))
    with pytest.raises(ScanError, match="one sensor"):
        write_case(hall, mixed, tmp_path / "mixed", site="a", kind="real")
    assert list(tmp_path.iterdir()) == []


def test_a_case_replaces_nothing(five: Recording, hall: OccupancyGrid, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="exists"):
        write_case(hall, replace(five, truth=np.zeros((5, 3))), tmp_path, site="a", kind="real")


def test_poses_of_another_time_are_refused(five: Recording) -> None:
    with pytest.raises(InputError, match=r"0\.0 s to 0\.8 s, the 1 poses from 99\.0 s"):
        with_truth(five, Trajectory([99.0], [[0, 0, 0]]))
    with pytest.raises(InputError, match="--truth"):
        with_truth(five, None)
