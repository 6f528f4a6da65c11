"""The rooms of the drawn hotel look alike from inside, and the corridor tells them apart."""

import numpy as np
import pytest

from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.worlds.hotel import HOTEL_START, ROOM_WIDTH, hotel

BEARINGS = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def seen(room: int, T_start_base: SE2) -> np.ndarray:
    """Look around in a room, as far as a cheap sensor does."""
    T_map_room = SE2((room - 2) * ROOM_WIDTH, 0.0, 0.0)
    return expected_ranges(hotel(), T_map_room @ HOTEL_START @ T_start_base, BEARINGS, 12.0)


@pytest.mark.parametrize("room", [0, 1, 3])
def test_the_rooms_are_alike_at_the_start_and_differ_two_metres_further(room: int) -> None:
    ahead = SE2(0.0, -2.0, 0.0)
    np.testing.assert_allclose(seen(room, SE2.identity()), seen(2, SE2.identity()), atol=1e-6)
    differs = np.abs(seen(room, ahead) - seen(2, ahead)) > 0.3
    assert np.mean(differs) > 0.03
