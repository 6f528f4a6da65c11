"""A localizer counts what contradicts the map while it knows where the robot is."""

import numpy as np

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.localizer.config import ChangesConfig, LocalizerConfig
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer
from firstfix.localizer.outputs import TrackedPose
from firstfix.localizer.replay import replay
from firstfix.localizer.states import State

KEEPS = LocalizerConfig(changes=ChangesConfig(days_kept=2))


def test_by_default_nothing_is_kept(hall_plan: OccupancyGrid) -> None:
    localizer = Localizer()
    localizer.handle(NewMap(0.0, hall_plan))
    assert localizer.changes is None


def test_views_of_a_localized_robot_count(hall_plan: OccupancyGrid, driven: Recording) -> None:
    localizer = Localizer(KEEPS)
    localizer.handle(NewMap(100.0, hall_plan))
    counter, published = localizer.changes, 0
    assert counter is not None
    for _, outputs in replay(driven.messages(), localizer):
        published += any(isinstance(output, TrackedPose) for output in outputs)
        assert counter.views <= published
    assert localizer.state is State.LOCALIZED
    assert counter.views > 10
    assert counter.explained > 0.95


def test_without_a_pose_nothing_counts(hall_plan: OccupancyGrid, driven: Recording) -> None:
    cells = np.zeros_like(hall_plan.cells)
    cells[40:44, 60:90] = 100
    localizer = Localizer(KEEPS)
    localizer.handle(NewMap(100.0, OccupancyGrid(cells, 0.05)))
    for given in driven.messages():
        localizer.handle(given)
    assert localizer.changes is not None
    assert localizer.changes.views == 0


def test_a_new_map_starts_anew(hall_plan: OccupancyGrid, driven: Recording) -> None:
    localizer = Localizer(KEEPS)
    localizer.handle(NewMap(100.0, hall_plan))
    for given in driven.messages():
        localizer.handle(given)
    localizer.handle(NewMap(200.0, hall_plan))
    assert localizer.changes is not None
    assert localizer.changes.days == ()
