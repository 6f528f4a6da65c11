"""The drawn flat is small and full, and a robot gets everywhere."""

import numpy as np
from scipy import ndimage

from firstfix.lab.simulation.floor import Floor
from firstfix.lab.worlds.house import house


def test_a_robot_gets_into_every_room() -> None:
    floor = Floor(house())
    parts, _ = ndimage.label(floor.room >= 0.23)
    rooms = {
        "living room": (2.5, 3.3),
        "kitchen": (6.5, 1.6),
        "bath": (9.6, 2.6),
        "hall": (7.5, 4.2),
        "bedroom": (3.2, 6.4),
        "study": (7.5, 6.5),
    }
    middles = floor.grid.to_cells(np.array(list(rooms.values()))).astype(int)
    assert len({int(parts[row, column]) for column, row in middles}) == 1
    assert all(parts[row, column] > 0 for column, row in middles)
