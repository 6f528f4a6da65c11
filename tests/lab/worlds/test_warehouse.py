"""The drawn warehouse repeats itself but for its ends."""

import numpy as np
from scipy import ndimage

from firstfix.core.se2 import SE2
from firstfix.fields.raycast import expected_ranges
from firstfix.lab.worlds.warehouse import AISLE_PITCH, warehouse

BEARINGS = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def test_every_corner_of_it_can_be_reached() -> None:
    _, parts = ndimage.label(warehouse().free)
    assert parts == 1


def test_between_the_racks_one_aisle_looks_like_the_next() -> None:
    views = [
        expected_ranges(warehouse(), SE2(6.8 + i * AISLE_PITCH, 6.0, 0.4), BEARINGS, 5.0)
        for i in range(3)
    ]
    np.testing.assert_allclose(views[1], views[0], atol=1e-6)
    np.testing.assert_allclose(views[2], views[0], atol=1e-6)


def test_its_corners_do_not_look_alike() -> None:
    free = warehouse().free
    assert (free != free[::-1]).any()
    assert (free != free[:, ::-1]).any()
    assert (free != free[::-1, ::-1]).any()
