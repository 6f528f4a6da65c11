"""Rides in a lift of a building with twins."""

from __future__ import annotations

import pytest

from firstfix.lab.experiments.lift_bench import Teller, ride_lifts
from firstfix.lab.worlds.towers import tower, write_tower


@pytest.mark.slow
def test_no_pose_on_a_wrong_floor(tmp_path):
    floors = tower(1, 5, 400.0)  # the fifth is like no other: there it begins
    folder = write_tower(tmp_path / "tower", floors)
    rides = list(ride_lifts(floors, folder, 2, 1, tmp_path / "cache", Teller.LIFT))
    assert len(rides) == 2
    assert sum(ride.wrong_map for ride in rides) == 0
