"""The drawn office is one building, and no place of it is another."""

import numpy as np
import pytest
from scipy import ndimage

from firstfix.lab.worlds.office import office


def test_every_room_of_the_office_can_be_reached() -> None:
    _, rooms = ndimage.label(office().free)
    assert rooms == 1


def test_the_office_is_about_40_by_25_metres_at_5_cm() -> None:
    grid = office()
    rows, columns = np.nonzero(grid.occupied)
    assert grid.resolution == 0.05
    assert np.ptp(columns) * grid.resolution == pytest.approx(40.0, abs=0.5)
    assert np.ptp(rows) * grid.resolution == pytest.approx(25.0, abs=0.5)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_the_office_does_not_repeat_itself_when_turned(turns: int) -> None:
    free = office().free
    turned = np.rot90(free, turns)
    assert turned.shape != free.shape or np.mean(turned != free) > 0.05
