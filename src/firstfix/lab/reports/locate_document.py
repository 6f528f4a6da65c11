"""The figures of ``firstfix bench CASES``, as JSON and as tables.

The JSON document has stable keys and no NaN::

    {"cases": [{"name", "method", "sensor", "site", "kind", "free_area_m2",
                ...the figures of `metrics.Summary`..., "prepare_s", "rss_mb"}, ...],
     "wrong_map": {"n", "unique"},
     "total": {"name": "total", "method", "sensor", ...the same figures...},
     "totals": [...one such total for each method and sensor...],
     "wrong_map_cases": [{"name", "on", "method", "sensor", "n", "unique"}, ...],
     "sensors": [{"method", "sensor", "n", "success", "recall_10", "unique", "wrong_unique",
                  "wrong_of_unique", "wrong_map_n", "wrong_map_unique"}, ...],
     "buildings": [{"site", ...the same keys...}, ...],
     "reliability": [...see `reliability`...],
     "machine": {...see `machine.this_machine`...}}

``total`` and ``wrong_map`` are those of the first method and sensor. In ``totals`` every case
counts alike; in ``sensors`` and ``buildings`` every scan does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, TypeVar

from firstfix.lab.experiments.locate_bench import CaseRun, WrongMapRun
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.metrics.metrics import mean_of_known, summarize, total
from firstfix.lab.metrics.reliability import reliability_document
from firstfix.lab.reports.text import Row, columns_table, markdown_table

# Title, key in the document, format.
COLUMNS = (
    ("n", "n", ".0f"),
    ("success", "success", ".1%"),
    ("0.2 m 3°", "success_02", ".1%"),
    ("recall@10", "recall_10", ".1%"),
    ("unique", "unique", ".1%"),
    ("right", "unique_right", ".1%"),
    ("wrong", "wrong_unique", ".0f"),
    ("median m", "median_m", ".3f"),
    ("median °", "median_deg", ".2f"),
    ("p95 m", "p95_m", ".3f"),
    ("CPU s", "cpu_s", ".3f"),
    ("p95 CPU s", "cpu_s_p95", ".3f"),
    ("wall s", "wall_s", ".3f"),
    ("prepare s", "prepare_s", ".2f"),
    ("RSS MB", "rss_mb", ".0f"),
)
SCAN_COLUMNS = (
    ("scans", "n", ".0f"),
    ("success", "success", ".1%"),
    ("recall@10", "recall_10", ".1%"),
    ("UNIQUE", "unique", ".1%"),
    ("wrong", "wrong_unique", ".0f"),
    ("wrong when UNIQUE", "wrong_of_unique", ".2%"),
    ("scans on a wrong map", "wrong_map_n", ".0f"),
    ("UNIQUE on a wrong map", "wrong_map_unique", ".2%"),
)
_WORDS = {"method": "method", "sensor": "sensor"}

AnyRun = TypeVar("AnyRun", CaseRun, WrongMapRun)


def bench_document(
    runs: Sequence[CaseRun], wrong_map: Sequence[WrongMapRun] = ()
) -> dict[str, Any]:
    """Put cases in their own maps, at least one, and in wrong maps into the document above."""
    groups = [
        (_with(setting, runs), _with(setting, wrong_map))
        for setting in dict.fromkeys(_setting(run) for run in runs)
    ]
    totals = [_total(own) for own, _ in groups]
    _, first = groups[0]
    return {
        "cases": [case_row(run) for run in runs],
        "wrong_map": {"n": sum(r.n for r in first), "unique": sum(r.unique for r in first)},
        "total": totals[0],
        "totals": totals,
        "wrong_map_cases": [
            {
                "name": run.case,
                "on": run.on,
                "method": run.method,
                "sensor": run.sensor,
                "n": run.n,
                "unique": run.unique,
            }
            for run in wrong_map
        ],
        "sensors": [_scans_row(own, others) for own, others in groups],
        "buildings": [
            {"site": site, **_scans_row(_of(site, own), _of(site, others))}
            for own, others in groups
            for site in dict.fromkeys(run.site for run in own)
        ],
        "reliability": reliability_document(runs, wrong_map),
        "machine": this_machine(),
    }


def case_row(run: CaseRun) -> dict[str, Any]:
    """Put one case into figures."""
    return {
        "name": run.case,
        "method": run.method,
        "sensor": run.sensor,
        "site": run.site,
        "kind": run.kind,
        "free_area_m2": run.free_area_m2,
        **asdict(summarize(run.outcomes)),
        "prepare_s": run.prepare_s,
        "rss_mb": run.rss_mb,
    }


def bench_table(document: Row) -> str:
    """Lay out cases and totals."""
    rows = [*document["cases"], *document["totals"]]
    return columns_table(rows, {"case": "name", **_WORDS}, COLUMNS)


def sensors_table(document: Row) -> str:
    """Lay out the figures of every method and sensor over all scans."""
    return columns_table(document["sensors"], _WORDS, SCAN_COLUMNS)


def buildings_table(document: Row) -> str:
    """Lay out the figures of every building over all of its scans."""
    return columns_table(document["buildings"], {"building": "site", **_WORDS}, SCAN_COLUMNS)


def wrong_map_table(document: Row) -> str:
    """Lay out the scans that were located in maps of other buildings."""
    head = ["scans of", "on the map of", "method", "sensor", "n", "unique (all wrong)"]
    cells = [
        [row["name"], row["on"], row["method"], row["sensor"], str(row["n"]), str(row["unique"])]
        for row in document["wrong_map_cases"]
    ]
    return markdown_table(head, cells)


def _setting(run: CaseRun | WrongMapRun) -> tuple[str, str]:
    return run.method, run.sensor


def _with(setting: tuple[str, str], runs: Sequence[AnyRun]) -> list[AnyRun]:
    return [run for run in runs if _setting(run) == setting]


def _of(site: str, runs: Sequence[AnyRun]) -> list[AnyRun]:
    return [run for run in runs if run.site == site]


def _total(runs: Sequence[CaseRun]) -> dict[str, Any]:
    return {
        "name": "total",
        "method": runs[0].method,
        "sensor": runs[0].sensor,
        "free_area_m2": mean_of_known(run.free_area_m2 for run in runs),
        **asdict(total([summarize(run.outcomes) for run in runs])),
        "prepare_s": mean_of_known(run.prepare_s for run in runs),
        "rss_mb": mean_of_known(run.rss_mb for run in runs),
    }


def _scans_row(runs: Sequence[CaseRun], wrong_map: Sequence[WrongMapRun]) -> dict[str, Any]:
    figures = summarize([outcome for run in runs for outcome in run.outcomes])
    unique = round((figures.unique or 0.0) * figures.n)
    others = sum(run.n for run in wrong_map)
    accepted = sum(run.unique for run in wrong_map)
    return {
        "method": runs[0].method,
        "sensor": runs[0].sensor,
        "n": figures.n,
        "success": figures.success,
        "recall_10": figures.recall_10,
        "unique": figures.unique,
        "wrong_unique": figures.wrong_unique,
        "wrong_of_unique": figures.wrong_unique / unique if unique else None,
        "wrong_map_n": others,
        "wrong_map_unique": accepted / others if others else None,
    }
