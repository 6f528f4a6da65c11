"""A simulated drive becomes a log that can be followed."""

import numpy as np
import pytest

from firstfix.core.errors import ScanError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.lab.scenarios.phases import DriveTo, Pause, Stand, Teleport
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record


def test_a_log_has_odometry_and_truth_at_every_scan(hall_plan: OccupancyGrid) -> None:
    script = Scenario(
        [DriveTo(SE2(7.5, 5.0, 0.0)), Pause(0.5), Teleport(SE2(1.5, 1.5, 0.0)), Stand(0.3)],
        start=SE2(3.0, 1.5, 0.3),
    )
    moments = list(run(script, hall_plan, seed=4))
    log = record(iter(moments))
    assert len(log) == sum(moment.scan is not None for moment in moments)
    assert log.odometry is not None
    assert log.truth is not None
    assert all(log.odometry.at(scan.stamp) is not None for scan in log.scans)
    np.testing.assert_allclose(log.truth[0], [3.0, 1.5, 0.3])
    np.testing.assert_allclose(log.truth[-1], [1.5, 1.5, 0.0])
    (note,) = log.notes
    assert note.startswith("teleported until")


def test_nothing_seen_is_no_log(hall_plan: OccupancyGrid) -> None:
    script = Scenario([Pause(0.5)], start=SE2(3.0, 1.5, 0.3))
    with pytest.raises(ScanError, match="at least one scan"):
        record(run(script, hall_plan, seed=4))
