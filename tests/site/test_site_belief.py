"""What is known of a robot in a site, from one view to the next."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from site_lab import ROOMS, draw, save_rooms, scan_in

from firstfix.belief.prior import Near
from firstfix.belief.view import View
from firstfix.core.errors import InputError
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.io.maps.map_server import save_map
from firstfix.site.query import SitePrior
from firstfix.site.result import SiteResult
from firstfix.site.site import Site
from firstfix.site.site_belief import (
    VIEWS,
    SiteBelief,
    believe,
    is_blind,
    maps_to_follow,
    with_view,
)

# A sensor that sees too little for one view.
NARROW = {"beams": 61, "fov": 1.2, "range_max": 4.0, "sigma_m": 0.01}
START = SE2(3.9, 1.7, 0.6)
WAY = [SE2(3.9 + 0.1 * i, 1.7, 0.6 + 0.7 * i) for i in range(6)]


def view_in(room: str, pose: SE2, stamp: float, **sensor: float) -> View:
    odometry = START.inverse() @ pose
    return View.of(scan_in(room, pose, round(stamp), stamp, **sensor), odometry)


def ask(
    site: Site, belief: SiteBelief, parts: Sequence[Sequence[str]] = ()
) -> tuple[SiteResult, SiteBelief]:
    """Do what the service does with a view after the first, with maps spread over parts."""
    query = belief.newest if belief.is_followed else belief.query
    parts = parts or [site.map_ids]
    looked = [site.first_look(query, part) for part in parts]
    names = maps_to_follow(belief, looked)
    chosen = [[name for name in part if name in names] for part in parts]
    jobs = pickle.loads(pickle.dumps([belief.of_maps(part) for part in chosen]))  # noqa: S301
    found = [site.follow(job, part) for job, part in zip(jobs, chosen, strict=True)]
    return believe(belief, looked, pickle.loads(pickle.dumps(found)))  # noqa: S301


def drive(
    site: Site,
    views: Sequence[View],
    parts: Sequence[Sequence[str]] = (),
    prior: SitePrior | None = None,
) -> tuple[list[SiteResult], SiteBelief]:
    results, belief = [], with_view(SiteBelief(), views[0], prior)
    for view in views[1:]:
        result, belief = ask(site, with_view(belief, view), parts)
        results.append(result)
    return results, belief


def narrow_views(room: str) -> list[View]:
    return [view_in(room, pose, float(i), **NARROW) for i, pose in enumerate(WAY)]


def test_views_decide_as_if_all_were_judged_anew(site: Site) -> None:
    views = narrow_views("second")
    results, _ = drive(site, views)
    scans = [view.scans[0] for view in views]
    for i, result in enumerate(results):
        end = i + 2
        anew = site.locate(scans[:end], [view.T_odom_base for view in views[:end]])
        if end == 2:  # nothing is known before: all views are searched
            assert (result.verdict, result.reason) == (anew.verdict, anew.reason)
            assert result.map_probabilities == pytest.approx(anew.map_probabilities)
    assert (results[-1].verdict, results[-1].map_id) == (Verdict.UNIQUE, "second")
    assert results[-1].best is not None
    assert results[-1].best.pose.distance_to(WAY[-1]) < 0.1


def test_parts_and_processes_do_not_matter(site: Site) -> None:
    views = narrow_views("first")
    whole, _ = drive(site, views)
    for parts in ([["first"], ["second", "ground"]], [["second"], ["ground"], ["first"]]):
        spread, _ = drive(site, views, parts)
        for one, other in zip(whole, spread, strict=True):
            assert one.verdict is other.verdict
            assert one.map_probabilities == pytest.approx(other.map_probabilities, abs=1e-12)
            assert [h.pose for h in one.hypotheses[:3]] == [h.pose for h in other.hypotheses[:3]]


def test_memory_is_bounded_and_small_once_the_robot_is_found(site: Site) -> None:
    around = [SE2(3.9, 1.7, 0.6 + 0.5 * i) for i in range(VIEWS + 4)]
    views = [view_in("second", pose, float(i)) for i, pose in enumerate(around)]
    results, belief = drive(site, views)
    assert len(belief.views) == len(belief.totals) == VIEWS
    assert results[-1].verdict is Verdict.UNIQUE
    assert list(belief.maps) == ["second"], "maps that do not fit are left"
    assert belief.maps["second"].past.shape[1] == VIEWS
    assert len(pickle.dumps(belief)) < 200_000


def test_places_of_all_maps_are_limited(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firstfix.site.site_belief.PLACES", 20)
    _, belief = drive(site, narrow_views("first")[:2])
    assert 0 < sum(len(held.tracks) for held in belief.maps.values()) <= 20


def test_a_map_that_was_left_comes_back(site: Site) -> None:
    views = [view_in("second", pose, float(i)) for i, pose in enumerate(WAY[:4])]
    _, belief = drive(site, views)
    assert "ground" not in belief.maps
    names = maps_to_follow(
        with_view(belief, view_in("ground", WAY[4], 4.0)),
        [site.first_look(site.query(views[0].scans))],
    )
    assert set(names) == set(site.map_ids)


def test_a_robot_that_was_carried_is_found_again(site: Site) -> None:
    # Odometry does not notice a ride in a lift.
    poses = [SE2(3.9, 1.7, 0.6 + 0.5 * i) for i in range(12)]
    rooms = ["second"] * 4 + ["first"] * 8
    views = [
        view_in(room, pose, float(i))
        for i, (room, pose) in enumerate(zip(rooms, poses, strict=True))
    ]
    belief = with_view(SiteBelief(), views[0])
    results = []
    for view in views[1:]:
        belief = with_view(belief, view)
        if len(belief.views) > 1:  # else it was started anew
            result, belief = ask(site, belief)
            results.append(result)
    assert results[2].map_id == "second"
    assert (results[-1].verdict, results[-1].map_id) == (Verdict.UNIQUE, "first")


def test_a_robot_that_stands_still_fills_no_window(site: Site) -> None:
    start, end = WAY[:2]
    poses = [start, end, *[end] * 6]
    views = [view_in("first", pose, float(i)) for i, pose in enumerate(poses)]
    results, belief = drive(site, views)
    assert len(belief.views) == len(belief.totals) == 2
    assert len(belief.views[-1]) <= 3
    assert results[-1].map_id == "first"


def test_a_view_that_is_no_news_is_dropped_by_the_next(site: Site) -> None:
    steps = [SE2(3.9 + x, 1.7, 0.6) for x in (0.0, 0.4, 0.5, 0.9)]
    views = [view_in("first", pose, float(i)) for i, pose in enumerate(steps)]
    results, belief = drive(site, views)
    seen = [group[-1].T_odom_base for group in belief.views]
    assert seen == [START.inverse() @ steps[i] for i in (0, 1, 3)]
    assert {held.past.shape[1] for held in belief.maps.values()} == {3}
    assert results[-1].map_id == "first"


def test_a_jump_of_the_odometry_starts_anew(site: Site) -> None:
    _, belief = drive(site, narrow_views("first")[:3])
    scan = belief.views[-1][-1].scans[0]
    jumped = with_view(belief, View.of(scan, SE2(50.0, 0.0, 0.0)))
    assert (len(jumped.views), jumped.totals, dict(jumped.maps)) == (1, (), {})
    with pytest.raises(InputError, match="scans in order of time"):
        with_view(belief, narrow_views("first")[0])


def test_a_prior_holds_from_its_view_on(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    (tmp_path / "site.yaml").write_text(
        "maps:\n  low: {map: ground, floor: 0}\n  high: {map: ground, floor: 1}\n"
    )
    site = Site.load(tmp_path)
    views = [view_in("ground", pose, float(i)) for i, pose in enumerate(WAY[:4])]
    unknown, _ = drive(site, views)
    assert unknown[-1].verdict is Verdict.AMBIGUOUS
    told, belief = drive(site, views, prior={"high": Near(START, 1.0)})
    assert (told[-1].verdict, told[-1].map_id) == (Verdict.UNIQUE, "high")
    assert belief.prior is not None


def test_a_view_without_surfaces_is_blind() -> None:
    assert is_blind(view_in("ground", START, 0.0, range_max=0.2))
    assert not is_blind(view_in("ground", START, 0.0))


def test_copies_are_no_rivals_from_view_to_view(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    save_map(draw(ROOMS["ground"]), tmp_path / "copy.yaml")
    site = Site.load(tmp_path)
    results, _ = drive(site, [view_in("ground", p, float(i)) for i, p in enumerate(WAY[:3])])
    assert results[-1].verdict is Verdict.UNIQUE
    assert {results[-1].map_id, results[-1].same_places[0][0].map_id} == {"copy", "ground"}


def test_a_part_without_a_usable_map_adds_nothing(tmp_path: Path) -> None:
    save_rooms(tmp_path)
    (tmp_path / "first" / "map.pgm").unlink()
    site = Site.load(tmp_path)
    _, belief = drive(site, [view_in("ground", p, float(i)) for i, p in enumerate(WAY[:3])])
    belief = with_view(belief, view_in("ground", WAY[3], 3.0))
    nothing = site.follow(belief, ["first"])
    assert (nothing.found.places, dict(nothing.maps)) == ((), {})
    np.testing.assert_array_equal(nothing.found.totals, [-np.inf])
    assert "first" in nothing.found.faults[0]
