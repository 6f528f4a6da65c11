"""Changes of a tiny building are found, and nothing else."""

from collections.abc import Callable

import numpy as np
import pytest

from firstfix.changes.counts import ChangeCounter, DayCounts
from firstfix.changes.survey import Change, find_changes
from firstfix.core.errors import InputError
from firstfix.core.grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.simulation.rigs import RIGS
from firstfix.lab.worlds.drawing import Drawing

DAY_S = 86400.0
LIDAR = Lidar(beams=360, sigma_m=0.01)
# 8 m along the hall and back, 0.25 m a step.
PATH = [SE2(1.0 + 0.25 * k, 2.0, 0.0) for k in range(32)]


def drawn(change: Callable[[Drawing], None] = lambda _: None) -> OccupancyGrid:
    """A hall of 10 x 4 m with a wall across a part of it, unknown space behind; changed or not."""
    plan = Drawing(10.0, 7.0, 0.05, 0.5)
    plan.room(0.0, 0.0, 10.0, 4.0)
    plan.solid(5.0, 2.6, 5.1, 3.9)
    change(plan)
    return plan.grid()


@pytest.fixture(scope="session")
def plan() -> OccupancyGrid:
    return drawn()


def drive(
    mapped: OccupancyGrid,
    worlds: list[OccupancyGrid],
    *,
    off: SE2 | None = None,
    day: int = 20_000,
    counter: ChangeCounter | None = None,
) -> ChangeCounter:
    """Count a drive; one world for each pose in turn, so that people can move."""
    counter = counter or ChangeCounter(MapFields(mapped))
    rng = np.random.default_rng(0)
    for k, pose in enumerate(PATH):
        scan = LIDAR.scan(worlds[k % len(worlds)], pose, rng, stamp=DAY_S * day + k)
        counter.add([scan], pose @ off if off is not None else pose, np.zeros((3, 3)))
    return counter


def areas(plan: OccupancyGrid, counter: ChangeCounter) -> dict[Change, float]:
    found = find_changes(plan, counter.days)
    return {
        change: found.area_m2(change) for change in Change if found.area_m2(change) > 0.0 and change
    }


def test_a_building_as_mapped_has_not_changed(plan: OccupancyGrid) -> None:
    counter = drive(plan, [plan])
    assert counter.views > 10
    assert counter.explained == 1.0
    assert find_changes(plan, counter.days).areas == ()


@pytest.mark.parametrize("off", [SE2(0.05, 0.03, 0.0), SE2(0.0, -0.05, 0.01)])
def test_a_pose_that_is_a_little_wrong_changes_nothing(plan: OccupancyGrid, off: SE2) -> None:
    assert areas(plan, drive(plan, [plan], off=off)) == {}


def test_a_wall_that_is_gone(plan: OccupancyGrid) -> None:
    now = drawn(lambda p: p.free(4.9, 2.6, 5.2, 3.9))
    counter = drive(plan, [now])
    (area,) = find_changes(plan, counter.days).areas
    assert area.change is Change.GONE
    assert (area.x, area.y) == pytest.approx((5.05, 3.2), abs=0.3)
    assert area.area_m2 == pytest.approx(0.1 * 1.3, rel=0.35)
    assert (area.days, area.height_m) == (1, pytest.approx(1.2, abs=0.35))


def test_a_cabinet_that_is_new(plan: OccupancyGrid) -> None:
    now = drawn(lambda p: p.solid(7.0, 3.0, 7.8, 3.4))
    (area,) = find_changes(plan, drive(plan, [now]).days).areas
    assert area.change is Change.NEW
    assert (area.x, area.y) == pytest.approx((7.4, 3.05), abs=0.5)
    assert area.width_m == pytest.approx(0.8, abs=0.15)


def test_a_person_who_walks_is_no_change(plan: OccupancyGrid) -> None:
    def with_person(x: float) -> OccupancyGrid:
        return drawn(lambda p: p.solid(x, 3.0, x + 0.3, 3.3))

    walking = [with_person(8.5 - 0.25 * k) for k in range(len(PATH))]
    counter = drive(plan, walking)
    assert counter.explained < 0.99
    assert areas(plan, counter) == {}


def test_a_room_behind_a_wall_that_is_gone_was_unknown(plan: OccupancyGrid) -> None:
    def opened(p: Drawing) -> None:
        p.room(7.0, 4.0, 9.0, 6.0)
        p.free(7.2, 3.8, 8.8, 4.2)

    now = drawn(opened)
    found = areas(plan, drive(plan, [now]))
    assert found[Change.GONE] == pytest.approx(1.6 * 0.2, rel=0.4)
    assert found[Change.FOUND_FREE] > 0.2


def test_layer_and_redrawn_map_show_the_changes(plan: OccupancyGrid) -> None:
    def changed(p: Drawing) -> None:
        p.free(4.9, 2.6, 5.2, 3.9)
        p.solid(7.0, 3.0, 7.8, 3.4)

    now = drawn(changed)
    changes = find_changes(plan, drive(plan, [now]).days)
    layer, redrawn = changes.layer().cells, changes.redrawn().cells
    new, gone = changes.kinds == Change.NEW, changes.kinds == Change.GONE
    assert new.any()
    assert gone.any()
    for cells in (layer, redrawn):
        assert (cells[new] == OCCUPIED).all()
        assert (cells[gone] == FREE).all()
    same = changes.kinds == Change.NONE
    assert (layer[same] == UNKNOWN).all()
    np.testing.assert_array_equal(redrawn[same], plan.cells[same])


def test_the_newest_day_decides_and_days_are_counted(plan: OccupancyGrid) -> None:
    now = drawn(lambda p: p.solid(7.0, 3.0, 7.8, 3.4))
    counter = drive(plan, [now], day=1)
    drive(plan, [now], day=2, counter=counter)
    changes = find_changes(plan, counter.days)
    assert changes.dates == ("1970-01-02", "1970-01-03")
    assert {area.days for area in changes.areas} == {2}
    assert find_changes(plan, counter.days[:1], fewest_days=2).areas == ()
    # Carried away on the third day.
    drive(plan, [plan], day=3, counter=counter)
    assert find_changes(plan, counter.days).areas == ()


def test_counts_of_one_day_add_up(plan: OccupancyGrid) -> None:
    now = drawn(lambda p: p.solid(7.0, 3.0, 7.8, 3.4))
    (day,) = drive(plan, [now]).days
    both = day.merged_with(day)
    assert (both.views, both.beams) == (2 * day.views, 2 * day.beams)
    np.testing.assert_array_equal(both.hits, 2 * day.hits)
    (other,) = drive(plan, [now], day=7).days
    with pytest.raises(InputError, match="same day"):
        day.merged_with(other)
    with pytest.raises(InputError, match="twice"):
        find_changes(plan, [day, day])
    with pytest.raises(InputError, match="the map in which they were counted"):
        find_changes(OccupancyGrid(np.zeros((3, 4), np.int8), 0.05), [day])


def test_memory_is_bounded(plan: OccupancyGrid) -> None:
    counter = ChangeCounter(MapFields(plan), days_kept=2)
    for day in (3, 4, 5, 2):
        drive(plan, [plan], day=day, counter=counter)
    # A straggler counts for the oldest that is kept.
    assert [counts.day for counts in counter.days] == [4, 5]


def test_a_robot_at_rest_or_unsure_says_nothing_new(plan: OccupancyGrid) -> None:
    counter = ChangeCounter(MapFields(plan))
    scan = LIDAR.scan(plan, PATH[0], np.random.default_rng(0))
    assert counter.add([scan], PATH[0], np.zeros((3, 3)))
    assert not counter.add([scan], PATH[0], np.zeros((3, 3)))
    assert not counter.add([scan], PATH[8], np.diag([0.3**2, 0.0, 0.0]))
    assert counter.views == 1


def test_two_sensors_of_one_time_are_one_view(plan: OccupancyGrid) -> None:
    counter = ChangeCounter(MapFields(plan))
    scans = RIGS["two-lasers"].scans(plan, PATH[4], np.random.default_rng(0), stamp=DAY_S)
    counter.add(scans, PATH[4], np.zeros((3, 3)))
    assert counter.days[0].passes.max() == 1


def test_counts_are_checked() -> None:
    zeros = np.zeros((2, 3), np.uint16)
    with pytest.raises(InputError, match="uint16"):
        DayCounts(0, zeros, zeros, np.zeros((3, 2), np.uint16), 0, 0, 0)
