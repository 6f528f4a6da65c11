"""Losses of workers and broken maps, with an engine that fails as it is told."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import pytest
from fleet_lab import narrow_views, scan_of
from site_lab import ROOMS, draw

from firstfix.belief.view import View
from firstfix.core.estimate import Verdict
from firstfix.core.se2 import SE2
from firstfix.fleet import fleet as fleet_module
from firstfix.fleet.engine import WorkerLostError
from firstfix.fleet.fleet import Fleet, NotReadyError, UnknownMapError
from firstfix.fleet.jobs import Follow, Prepare, ShardedSite, open_map, parts_for, run_job, spread
from firstfix.io.maps.map_server import save_map
from firstfix.io.maps.site_yaml import read_site
from firstfix.site.query import SiteQuery
from firstfix.site.result import SiteResult
from firstfix.site.site_belief import SiteBelief

POSE = SE2(3.9, 1.7, 0.6)


class Here:
    """An engine in this process; loses the jobs that it is told to lose."""

    def __init__(self, sharded: ShardedSite) -> None:
        self._sites = [sharded.open(i) for i in range(len(sharded.shards))]
        self.losses: list[Any] = []

    async def ask(self, worker: int, job: Any) -> Any:
        if self.losses and self.losses.pop(0)(job):
            raise WorkerLostError
        return run_job(job, self._sites[worker])

    def close(self) -> None:
        """Nothing is to be ended."""


@pytest.fixture
def here(rooms: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Here, Fleet]:
    shards = spread(read_site(rooms).maps, 3)
    prepared = tmp_path_factory.getbasetemp() / "fleet-cache" / "sites"
    engine = Here(ShardedSite(rooms, shards, prepared, 10**9))
    return engine, Fleet(engine, shards)


@pytest.fixture(autouse=True)
def _no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet_module, "PAUSES_S", (0.0, 0.0, 0.0))


def test_shards_are_all_maps_once_and_of_one_size(rooms: Path) -> None:
    maps = read_site(rooms).maps
    for workers in (1, 2, 3, 50):
        shards = spread(maps, workers)
        assert sorted(name for shard in shards for name in shard) == sorted(m.id for m in maps)
        assert len(shards) == min(workers, len(maps))
        assert all(shards)
    assert spread(maps, 2) == spread(tuple(reversed(maps)), 2)


@pytest.mark.parametrize(
    ("maps", "workers", "parts"),
    [(5, 8, 1), (99, 8, 1), (100, 8, 2), (1000, 8, 8), (200, 6, 3), (1000, 7, 7), (0, 3, 1)],
)
def test_a_small_site_is_copied_and_a_large_one_is_spread(
    maps: int, workers: int, parts: int
) -> None:
    assert parts_for(maps, workers) == parts


def test_queries_go_to_the_copy_that_has_least_to_do(
    here: tuple[Here, Fleet], monkeypatch: pytest.MonkeyPatch
) -> None:
    engine, one = here
    fleet = Fleet(engine, one.shards, copies=2)
    asked: list[int] = []

    async def ask(worker: int, job: Any) -> Any:
        asked.append(worker)
        await asyncio.sleep(0.0)
        return await Here.ask(engine, worker % len(fleet.shards), job)

    monkeypatch.setattr(engine, "ask", ask)

    async def drive() -> list[str | None]:
        preparing = asyncio.create_task(fleet.prepare())
        while len(fleet.prepared) + len(fleet.faults) < len(fleet.map_ids):
            assert not fleet.is_ready
            await asyncio.sleep(0.0)
        assert not fleet.is_ready, "kernels are compiled first, also those of the copies"
        await preparing
        assert fleet.is_ready
        assert fleet.warm == set(range(2 * len(fleet.shards)))
        asked.clear()
        queries = [SiteQuery.of(scan_of(room, POSE)) for room in ("first", "second")]
        return [result.map_id for result in await asyncio.gather(*map(fleet.locate, queries))]

    assert asyncio.run(drive()) == ["first", "second"]
    assert set(asked) == set(range(2 * len(fleet.shards)))


def test_a_known_map_is_searched_where_it_is_held(
    here: tuple[Here, Fleet], rooms: Path, tmp_path: Path
) -> None:
    engine, fleet = here
    asyncio.run(fleet.prepare())
    asked: list[tuple[str, str]] = []
    losses = [True, False, False]

    async def on_map(map_id: str, job: Any) -> Any:
        asked.append((map_id, type(job).__name__))
        if losses.pop(0):
            raise WorkerLostError
        return run_job(job, open_map(rooms, map_id, tmp_path))

    query = SiteQuery.of(scan_of("second", POSE))
    by_owner = asyncio.run(fleet.locate(query, "second"))
    fleet.on_map = on_map
    engine.losses = [lambda _: True] * 100  # the workers are not asked
    found = asyncio.run(fleet.locate(query, "second"))
    assert asked == [("second", "Search")] * 2, "again after a loss"
    assert (found.map_id, found.searched) == ("second", ("second",))
    assert found.best is not None
    assert by_owner.best is not None
    assert found.best.pose == by_owner.best.pose
    assert asyncio.run(fleet.locate(query, "first")).map_id != "second"


def test_the_preparation_says_which_maps_are_done(here: tuple[Here, Fleet]) -> None:
    _, fleet = here
    done: list[str] = []
    asyncio.run(fleet.prepare(done.append))
    assert sorted(done) == list(fleet.map_ids)


def test_a_robot_is_followed_over_all_parts_and_a_loss_changes_nothing(
    here: tuple[Here, Fleet], rooms: Path, tmp_path: Path
) -> None:
    engine, fleet = here
    one = ShardedSite(rooms, (fleet.map_ids,), tmp_path, 10**9)
    whole = Fleet(Here(one), one.shards)
    views = narrow_views("first")

    async def answers(of: Fleet) -> list[SiteResult]:
        await of.prepare()
        belief, found = SiteBelief(), []
        for view in views:
            result, belief = await of.follow(belief, view)
            found.append(result)
        assert len(belief.views) == len(views)
        return found

    undisturbed = asyncio.run(answers(whole))
    assert undisturbed[0].verdict is Verdict.AMBIGUOUS
    assert (undisturbed[-1].verdict, undisturbed[-1].map_id) == (Verdict.UNIQUE, "first")
    left = [True, True]
    engine.losses = [lambda job: isinstance(job, Follow) and bool(left) and left.pop()] * 100
    disturbed = asyncio.run(answers(fleet))
    assert fleet.lost_jobs == 2
    # The places of a single view are listed part by part.
    for result, expected in zip(disturbed[1:], undisturbed[1:], strict=True):
        assert (result.verdict, result.reason) == (expected.verdict, expected.reason)
        assert result.map_probabilities == pytest.approx(expected.map_probabilities, abs=1e-9)


def test_a_twin_that_differs_by_one_cupboard_stays_open(tmp_path: Path) -> None:
    # The robot is where a cupboard was when the map was drawn. The other floor never had it.
    save_map(draw([*ROOMS["ground"], (2.2, 5.2, 3.2, 6.0)]), tmp_path / "own.yaml")
    save_map(draw(ROOMS["ground"]), tmp_path / "other.yaml")
    way = [POSE, SE2(4.3, 1.9, 0.6), SE2(4.7, 2.1, 0.8)]
    views = [View.of(scan_of("ground", pose, i), pose) for i, pose in enumerate(way)]

    async def verdicts() -> list[Verdict]:
        names = (("other",), ("own",))
        fleet = Fleet(Here(ShardedSite(tmp_path, names, tmp_path / "cache", 10**9)), names)
        await fleet.prepare()
        belief, found = SiteBelief(), []
        for view in views:
            result, belief = await fleet.follow(belief, view)
            found.append(result.verdict)
        return found

    assert asyncio.run(verdicts())[-1] is Verdict.UNIQUE, "a near copy is no rival"
    (tmp_path / "site.yaml").write_text(
        "maps:\n  own: {map: own.yaml, floor: 0}\n  other: {map: other.yaml, floor: 1}\n"
    )
    assert set(asyncio.run(verdicts())) == {Verdict.AMBIGUOUS}


def test_a_lost_job_is_given_again(here: tuple[Here, Fleet]) -> None:
    engine, fleet = here
    asyncio.run(fleet.prepare())
    engine.losses = [lambda _: True, lambda _: True, lambda _: False]
    result = asyncio.run(fleet.locate(SiteQuery.of(scan_of("second", POSE))))
    assert (result.verdict.value, result.map_id) == ("UNIQUE", "second")
    assert fleet.lost_jobs == 2


def test_without_a_part_of_the_maps_there_is_no_answer(here: tuple[Here, Fleet]) -> None:
    engine, fleet = here
    asyncio.run(fleet.prepare())
    engine.losses = [lambda _: True] * 100
    with pytest.raises(NotReadyError, match="its worker was lost"):
        asyncio.run(fleet.locate(SiteQuery.of(scan_of("second", POSE))))


def test_a_map_that_ends_every_worker_is_named(here: tuple[Here, Fleet]) -> None:
    engine, fleet = here
    engine.losses = [lambda job: isinstance(job, Prepare) and job.map_id == "first"] * 100
    asyncio.run(fleet.prepare())
    assert fleet.is_ready
    assert set(fleet.faults) == {"broken", "first"}
    assert fleet.faults["first"].endswith("each worker that prepares it is lost.")
    engine.losses = []
    result = asyncio.run(fleet.locate(SiteQuery.of(scan_of("second", POSE))))
    assert result.map_id == "second"


def test_queries_wait_for_preparation_and_known_maps(here: tuple[Here, Fleet]) -> None:
    _, fleet = here
    query = SiteQuery.of(scan_of("second", POSE))
    with pytest.raises(NotReadyError, match="5 of 5 maps are not prepared yet"):
        asyncio.run(fleet.locate(query))
    with pytest.raises(UnknownMapError, match="There is no map 'attic'"):
        asyncio.run(fleet.locate(query, "attic"))
