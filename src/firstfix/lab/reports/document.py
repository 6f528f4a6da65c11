"""The JSON document of a benchmark: stable keys, no NaN.

::

    {"cases": [{"name", "method", "site", "kind", "free_area_m2",
                ...the figures of `metrics.Summary`..., "prepare_s", "rss_mb"}, ...],
     "wrong_map": {"n", "unique"},
     "total": {"name": "total", "method", ...the same figures...},
     "totals": [...one such total for each method...],
     "wrong_map_cases": [{"name", "on", "method", "n", "unique"}, ...],
     "reliability": [...see `reliability`...],
     "machine": {...see `machine.this_machine`...}}

``total`` and ``wrong_map`` are those of the first method asked for: a mean over different methods
would be the figure of none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from firstfix.global_localization.config import Method
from firstfix.lab.experiments.case_runs import CaseRun, WrongMapRun
from firstfix.lab.experiments.machine import this_machine
from firstfix.lab.metrics.metrics import mean_of_known, summarize, total
from firstfix.lab.metrics.reliability import reliability_document


def bench_document(
    runs: Sequence[CaseRun], wrong_map: Sequence[WrongMapRun], methods: Sequence[Method]
) -> dict[str, Any]:
    """Put a benchmark into the document described above.

    Parameters
    ----------
    runs : sequence of CaseRun
        Cases on their own maps.
    wrong_map : sequence of WrongMapRun
        Cases on the maps of others.
    methods : sequence of Method
        In the order asked for, at least one.

    Returns
    -------
    dict
        Ready for JSON.
    """
    totals = [_total(runs, method) for method in methods]
    return {
        "cases": [case_row(run) for run in runs],
        "wrong_map": _wrong_map_total(wrong_map, methods[0]),
        "total": totals[0],
        "totals": totals,
        "wrong_map_cases": [
            {"name": f.case, "on": f.on, "method": f.method.value, "n": f.n, "unique": f.unique}
            for f in wrong_map
        ],
        "reliability": reliability_document(runs, wrong_map),
        "machine": this_machine(),
    }


def case_row(run: CaseRun) -> dict[str, Any]:
    """Put one case into figures."""
    return {
        "name": run.case,
        "method": run.method.value,
        "site": run.site,
        "kind": run.kind,
        "free_area_m2": run.free_area_m2,
        **asdict(summarize(run.outcomes)),
        "prepare_s": run.prepare_s,
        "rss_mb": run.rss_mb,
    }


def _total(runs: Sequence[CaseRun], method: Method) -> dict[str, Any]:
    own = [run for run in runs if run.method is method]
    return {
        "name": "total",
        "method": method.value,
        "free_area_m2": mean_of_known(run.free_area_m2 for run in own),
        **asdict(total([summarize(run.outcomes) for run in own])),
        "prepare_s": mean_of_known(run.prepare_s for run in own),
        "rss_mb": mean_of_known(run.rss_mb for run in own),
    }


def _wrong_map_total(wrong_map: Sequence[WrongMapRun], method: Method) -> dict[str, int]:
    own = [run for run in wrong_map if run.method is method]
    return {"n": sum(run.n for run in own), "unique": sum(run.unique for run in own)}
