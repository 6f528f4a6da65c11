"""The drawn corridor has the same door again and again, and two ends."""

import numpy as np

from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.worlds.corridor import DOOR_PITCH, corridor

BEARINGS = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def seen(x: float, yaw: float) -> np.ndarray:
    """Look from the middle line, as far as a cheap sensor does."""
    return expected_ranges(corridor(), SE2(x, 1.2, yaw), BEARINGS, 12.0)


def test_from_the_middle_no_door_differs_from_the_next() -> None:
    np.testing.assert_allclose(seen(26.3 + DOOR_PITCH, 0.4), seen(26.3, 0.4), atol=1e-6)


def test_each_end_looks_like_itself() -> None:
    west, east = seen(3.0, np.pi), seen(57.0, 0.0)
    assert np.mean(np.abs(np.minimum(west, 12.0) - np.minimum(east, 12.0)) > 0.3) > 0.02
