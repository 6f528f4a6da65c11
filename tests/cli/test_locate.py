"""``firstfix locate``."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firstfix.cli.answer import Waited, answer_text
from firstfix.core.estimate import Evidence, Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.se2 import SE2

Files = tuple[Path, Path]


def strict_json(line: str) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    document = json.loads(line, parse_constant=refuse)
    assert isinstance(document, dict)
    return document


def test_a_unique_place_is_described_in_text(cli, unique: Files) -> None:
    ended = cli("locate", *unique)
    assert ended.status == 0
    assert ended.out.startswith("UNIQUE: ")
    for word in ("pose ", "σ ", "probability ", "evidence ", "truth ", "search ", "time "):
        assert f"\n{word}" in ended.out
    assert ended.err == ""


def test_json_has_the_agreed_keys_and_the_true_pose(cli, unique: Files) -> None:
    ended = cli("locate", *unique, "--json", "--index", 1)
    assert ended.status == 0
    (line,) = ended.out.splitlines()
    answer = strict_json(line)
    assert list(answer) == [
        "index", "verdict", "reason", "pose", "covariance", "hypotheses",
        "probability_without_prior", "search", "elapsed_s", "error",
    ]  # fmt: skip
    assert (answer["index"], answer["verdict"]) == (1, "UNIQUE")
    np.testing.assert_allclose(answer["pose"], [7.5, 5.0, -2.0], atol=0.05)
    assert np.shape(answer["covariance"]) == (3, 3)
    assert answer["error"]["m"] < 0.05
    best = answer["hypotheses"][0]
    assert set(best) == {"pose", "covariance", "score", "probability", "evidence"}
    assert set(best["evidence"]) == {"explained", "short", "through_wall", "unknown", "beams"}
    assert set(answer["search"]) == {"poses", "searched", "proven"}


def test_a_place_there_is_twice_ends_with_1_and_lists_both(cli, alike: Files) -> None:
    ended = cli("locate", *alike, "--json")
    assert ended.status == 1
    answer = strict_json(ended.out)
    assert answer["verdict"] == "AMBIGUOUS"
    (x1, y1, yaw1), (x2, y2, yaw2) = (h["pose"] for h in answer["hypotheses"][:2])
    assert abs(x2 - x1) == pytest.approx(8.0, abs=0.05)
    assert (y1, yaw1) == pytest.approx((y2, yaw2), abs=0.05)
    printed = cli("locate", *alike)
    assert printed.status == 1
    assert "| rank |" in printed.out


@pytest.mark.parametrize(
    ("probabilities", "rows", "rest"),
    [
        ([1.0], 0, 0),
        ([0.98, 0.02], 2, 0),
        ([0.9995, 0.0002, 0.0001, 0.0001, 0.0001], 3, 2),
        ([0.9, 0.09, 0.005, 0.001, 0.0009], 4, 1),
        ([1 / 24] * 24, 10, 14),
    ],
)
def test_places_that_are_not_likely_at_all_are_not_listed(
    probabilities: list[float], rows: int, rest: int
) -> None:
    evidence = Evidence(explained=1.0, short=0.0, through_wall=0.0, unknown=0.0, beams=60)
    places = tuple(
        Hypothesis(SE2(float(i), 0.0, 0.0), np.eye(3), 0.1, p, evidence)
        for i, p in enumerate(probabilities)
    )
    search = SearchReport(poses=10, searched=1.0, proven=True)
    text = answer_text(
        LocateResult(Verdict.AMBIGUOUS, "why", places, search, 0.01), None, Waited(0.5, 0.2)
    )
    assert max(0, text.count("\n| ") - 2) == rows  # head and rule
    assert (f"and {rest} less likely ones" in text) == (rest > 0)


def test_all_scans_are_a_line_each_and_end_with_0(cli, unique: Files) -> None:
    ended = cli("locate", *unique, "--all", "--json")
    assert ended.status == 0
    assert [strict_json(line)["index"] for line in ended.out.splitlines()] == [0, 1, 2]
    assert cli("locate", *unique, "--all").out.count("scan ") == 3


@pytest.mark.parametrize("method", ["fast", "paper"])
def test_both_methods_find_it(cli, unique: Files, method: str) -> None:
    answer = strict_json(cli("locate", *unique, "--json", "--method", method).out)
    x, y, yaw = answer["hypotheses"][0]["pose"]
    assert math.hypot(x - 3.0, y - 2.0) < 0.5
    assert abs(yaw - 0.5) < math.radians(10.0)


@pytest.mark.slow
def test_the_picture_is_drawn_where_it_was_asked_for(cli, unique: Files, tmp_path: Path) -> None:
    ended = cli("locate", *unique, "--plot", "place.png")
    assert ended.status == 0
    assert f"picture: {tmp_path / 'place.png'}" in ended.err
    assert (tmp_path / "place.png").stat().st_size > 5000


def test_a_scan_without_truth_has_no_error(cli, unique: Files, tmp_path: Path) -> None:
    with np.load(unique[1]) as log:
        kept = {name: log[name] for name in log.files if name != "true_pose"}
    np.savez(tmp_path / "blind.npz", **kept)
    assert strict_json(cli("locate", unique[0], "blind.npz", "--json").out)["error"] is None
    assert "truth" not in cli("locate", unique[0], "blind.npz").out


def test_a_scan_without_hits_is_no_match(cli, unique: Files, tmp_path: Path) -> None:
    with np.load(unique[1]) as log:
        kept = dict(log)
    kept["ranges"] = np.full_like(kept["ranges"], np.nan)
    np.savez(tmp_path / "dark.npz", **kept)
    ended = cli("locate", unique[0], "dark.npz", "--json")
    assert ended.status == 1
    answer = strict_json(ended.out)
    assert (answer["verdict"], answer["pose"], answer["hypotheses"]) == ("NO_MATCH", None, [])
    assert answer["reason"]
    assert cli("locate", unique[0], "dark.npz").out.startswith("NO_MATCH: ")


@pytest.mark.shared
@pytest.mark.parametrize(
    ("case", "log"),
    [
        ("uob_cs_test0", "uob_trace0.bag"),
        ("olin_mac1_9_23", "olin_ros2"),
        ("intel_lab", "intel.carmen.log.gz"),
    ],
)
def test_logs_of_real_robots_are_read(cli, shared: Path, case: str, log: str) -> None:
    ended = cli("locate", shared / "cases" / case / "map.yaml", shared / "bags" / log, "--json")
    assert ended.status in (0, 1)
    assert strict_json(ended.out)["hypotheses"]
