"""Kidnaps in figures: the document, its tables, its report."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.lab.metrics.kidnap_trial import Aftermath, Instant, Trial
from firstfix.lab.reports.kidnap_report import (
    KidnapRun,
    judged_run,
    kidnap_document,
    kidnap_table,
    kinds_table,
    write_kidnap_report,
)

AGREED = [
    "name", "scenarios", "kidnaps", "signalled", "detected", "delay_s", "recovered", "recover_s",
    "recover_s_p95", "wrong_published", "false_alarms_per_h",
]  # fmt: skip

KIDNAP = Aftermath("teleport", 20.0, True, False, True, 1.0, 2.0)
MISSED = replace(KIDNAP, left_after_s=None, recovered_after_s=None)
UNKNOWN = replace(KIDNAP, known_before=False, left_after_s=0.0, recovered_after_s=4.0)
SIGNALLED = replace(KIDNAP, kind="carry", signalled=True, left_after_s=0.0, recovered_after_s=0.0)
SLIP = replace(KIDNAP, kind="slip", is_kidnap=False, left_after_s=0.0, recovered_after_s=9.0)
START = replace(KIDNAP, kind="start", is_kidnap=False, recovered_after_s=0.5)


def ran(world: str, kind: str, *aftermaths: Aftermath, **more: object) -> KidnapRun:
    trial = Trial(START, aftermaths, True, (), (), (), 900.0, 1800.0)
    return KidnapRun(world, kind, 0, replace(trial, **more), (), (0.001, 0.003))  # type: ignore[arg-type]


@pytest.fixture
def runs() -> list[KidnapRun]:
    return [
        ran("office", "teleport", KIDNAP, MISSED, wrong_fixes=(7,)),
        ran("office", "slip", SLIP, alarms=(3, 4)),
        ran("house", "carry", SIGNALLED, UNKNOWN, first_fix=False),
    ]


def test_worlds_are_counted(runs: list[KidnapRun]) -> None:
    document = kidnap_document(runs)
    office, house = document["worlds"]
    assert list(office)[: len(AGREED)] == AGREED
    assert list(office) == list(house) == list(document["total"])
    assert [office[key] for key in AGREED] == ["office", 2, 2, 0, 1, 1.0, 1, 2.0, 2.0, 1, 4.0]
    assert (office["slips"], office["slips_recovered"]) == (1, 1)
    assert (office["start_right"], office["start_wrong"], office["start_s"]) == (2, 0, 0.5)
    assert (office["hours"], office["calm_h"]) == (1.0, 0.5)
    assert office["cpu_ms_per_scan"] == pytest.approx(2.0)
    # Who was lost before had no old pose to give up: no delay of a detection.
    assert (house["detected"], house["delay_s"], house["known_before"]) == (2, 0.0, 1)
    assert (house["signalled"], house["start_wrong"]) == (1, 1)


def test_the_total_is_over_all_kidnaps_not_over_worlds(runs: list[KidnapRun]) -> None:
    total = kidnap_document(runs)["total"]
    assert (total["name"], total["scenarios"], total["kidnaps"]) == ("total", 3, 4)
    assert (total["detected"], total["recovered"], total["recover_s"]) == (3, 3, 2.0)
    assert total["recover_s_p95"] == pytest.approx(3.8)
    assert total["false_alarms_per_h"] == pytest.approx(2.0 / 0.75)


def test_slips_count_in_their_kind_only(runs: list[KidnapRun]) -> None:
    total = kidnap_document(runs)["total"]
    assert list(total["by_kind"]) == ["teleport", "slip", "carry"]
    slip = total["by_kind"]["slip"]
    assert (slip["disturbances"], slip["recovered"], slip["recover_s"]) == (1, 1, 9.0)
    assert total["recover_s_p95"] < 9.0


def test_what_is_not_known_is_null_and_the_document_is_json() -> None:
    document = kidnap_document([ran("office", "nothing", calm_s=0.0, start=None)], [("intel", "x")])
    row = document["total"]
    keys = ("delay_s", "recover_s", "recover_s_p95", "false_alarms_per_h", "start_s")
    assert [row[key] for key in keys] == [None] * 5
    assert document["left_out"] == [{"name": "intel", "why": "x"}]
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_tables_show_every_row_aligned(runs: list[KidnapRun]) -> None:
    document = kidnap_document(runs)
    for table, rows in ((kidnap_table(document), 3), (kinds_table(document), 3)):
        lines = table.splitlines()
        assert len(lines) == 2 + rows
        assert len({len(line) for line in lines}) == 1


def test_incidents_have_the_messages_around_them() -> None:
    home, away = SE2(0.0, 0.0, 0.0), SE2(4.0, 0.0, 0.0)
    instants = [
        Instant(
            0.1 * i,
            home if i < 150 else away,
            home,
            over="teleport" if i == 150 else None,
            localized=True,
            published=home,
            fixes=(away,) if i == 20 else (),
            said=("LOCALIZED 90% fit" if i < 150 else f"LOCALIZED only {i}% fit",),
        )
        for i in range(300)
    ]
    incidents = judged_run("office", "teleport", 3, instants).incidents
    assert [(round(i.stamp, 1), i.what) for i in incidents] == [
        (2.0, "wrong pose published, 4.00 m 0° off"),
        (15.0, "teleport: not detected"),
        (15.0, "teleport: not recovered"),
    ]
    assert incidents[1].said == (
        "14.5 LOCALIZED 90% fit | 0.00 m 0° off",
        "15.0 LOCALIZED only 150% fit | 4.00 m 0° off",
    )


@pytest.mark.slow
def test_the_report_has_tables_and_the_curve(runs: list[KidnapRun], tmp_path: Path) -> None:
    document = kidnap_document(runs, [("intel", "no odometry")])
    page = write_kidnap_report(runs, document, tmp_path / "report")
    text = page.read_text(encoding="utf-8")
    assert text.startswith("# firstfix bench --kidnap")
    assert "Left out: intel (no odometry)." in text
    assert kidnap_table(document).strip() in text
    assert (page.parent / "time_to_recover.png").stat().st_size > 5000
    nothing = [ran("office", "nothing")]
    assert "None." in write_kidnap_report(
        nothing, kidnap_document(nothing), tmp_path / "report"
    ).read_text(encoding="utf-8")


def test_a_report_that_cannot_be_written_is_refused(runs: list[KidnapRun], tmp_path: Path) -> None:
    (tmp_path / "report.md").mkdir()
    with pytest.raises(InputError, match="a place where results can be written"):
        write_kidnap_report(runs, kidnap_document(runs), tmp_path)
