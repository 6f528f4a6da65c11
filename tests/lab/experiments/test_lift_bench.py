"""Rides in a lift of a building with twins."""

from __future__ import annotations

import pytest

from firstfix.lab.experiments.lift_bench import Teller, ride_lifts
from firstfix.lab.worlds.towers import Likeness, tower, write_tower


@pytest.mark.slow
@pytest.mark.parametrize("teller", Teller)
def test_no_pose_on_a_wrong_floor(tmp_path, teller):
    """Where nobody tells the robot its floor, it stays in doubt between the twins."""
    floors = tower(1, 5, 100.0)  # the fifth is like no other: there it begins
    folder = write_tower(tmp_path / "tower", floors)
    rides = list(ride_lifts(floors, folder, 2, 2, tmp_path / "cache", teller))
    assert [ride.likeness for ride in rides] == [Likeness.TWIN] * 2
    assert sum(ride.wrong_map for ride in rides) == 0
    assert all(ride.poses > 0 for ride in rides)  # also before the lift
    assert all(ride.is_found for ride in rides) == (teller is Teller.LIFT)
