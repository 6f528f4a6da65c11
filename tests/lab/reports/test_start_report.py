"""Starts in figures, counted by hand."""

import json
from pathlib import Path

import pytest

from firstfix.lab.experiments.start_bench import Ending, StartRun
from firstfix.lab.reports.start_report import (
    buildings_table,
    sensors_table,
    start_document,
    write_start_report,
)


def run(site: str, ending: Ending, way_m: float, sensor: str = "60° x 5 m") -> StartRun:
    return StartRun(site, site, sensor, 0, ending, way_m, 2 * way_m, 4, 4, 2, 1, (1.0, 3.0))


RUNS = [
    run("a", Ending.RIGHT, 0.0),
    run("a", Ending.RIGHT, 1.0),
    run("b", Ending.WRONG, 3.0),
    run("b", Ending.OPEN, 6.0),
    run("b", Ending.OPEN, 2.0),
    run("a", Ending.RIGHT, 0.0, "recorded"),
]


def test_starts_are_counted_by_sensor() -> None:
    document = start_document(RUNS, 7, [("c", "no odometry")])
    narrow, recorded = document["sensors"]
    keys = ("sensor", "starts", "counted", "right", "wrong", "open")
    assert [narrow[key] for key in keys] == ["60° x 5 m", 5, 4, 2, 1, 1]
    assert (narrow["right_share"], narrow["wrong_share"], narrow["open_share"]) == (0.5, 0.25, 0.25)
    assert (narrow["way_m"], narrow["time_s"]) == (1.0, 2.0)
    assert narrow["way_m_p90"] is None  # an open start: its path length is unknown
    assert (narrow["reports"], narrow["listed"], narrow["elsewhere"]) == (20, 0.5, 0.25)
    assert narrow["contained"] == 0.75
    assert recorded["way_m_p90"] == 0.0
    assert document["left_out"] == [{"name": "c", "why": "no odometry"}]
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_every_building_has_a_row_and_every_start_too() -> None:
    document = start_document(RUNS, 7)
    rows = [(row["site"], row["sensor"], row["starts"]) for row in document["buildings"]]
    assert rows == [("a", "60° x 5 m", 2), ("b", "60° x 5 m", 3), ("a", "recorded", 1)]
    assert [start["ending"] for start in document["starts"]] == [r.ending.value for r in RUNS]
    for table, n in ((sensors_table(document), 2), (buildings_table(document), 3)):
        assert len(table.splitlines()) == 2 + n


@pytest.mark.slow
def test_the_report_shows_sensors_buildings_and_the_curve(tmp_path: Path) -> None:
    document = start_document(RUNS, 7, [("c", "no odometry")])
    page = write_start_report(RUNS, document, tmp_path)
    text = page.read_text(encoding="utf-8")
    assert sensors_table(document).strip() in text
    assert buildings_table(document).strip() in text
    assert "Left out: c (no odometry)." in text
    assert (page.parent / "way_to_first_pose.png").stat().st_size > 5000
