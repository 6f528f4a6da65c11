"""The paper's rooms are one floor each, and nearly but not quite symmetric."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import ndimage

from firstfix.core.grid import OccupancyGrid
from firstfix.lab.worlds.paper_rooms import laboratory, two_corridors

ROOMS = pytest.mark.parametrize("draw", [laboratory, two_corridors])


@ROOMS
def test_every_place_can_be_reached(draw: Callable[[], OccupancyGrid]) -> None:
    _, parts = ndimage.label(draw().free)
    assert parts == 1


@ROOMS
def test_a_half_turn_changes_little_but_something(draw: Callable[[], OccupancyGrid]) -> None:
    occupied = draw().occupied
    differing = np.mean(occupied != np.rot90(occupied, 2))
    assert 0.0 < differing < 0.01


@ROOMS
def test_no_mirror_makes_it_look_the_same(draw: Callable[[], OccupancyGrid]) -> None:
    occupied = draw().occupied
    for mirrored in (occupied[::-1], occupied[:, ::-1]):
        assert np.mean(occupied != mirrored) > 0.01
