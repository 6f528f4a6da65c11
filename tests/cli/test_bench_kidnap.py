"""``firstfix bench --kidnap``."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.lab.experiments.case import Case
from firstfix.lab.experiments.kidnap_bench import KidnapCaseTask, localized, simulated
from firstfix.lab.metrics.kidnap_trial import judge_trial
from firstfix.lab.scenarios import kidnap_scripts
from firstfix.lab.scenarios.kidnap_scripts import scripted
from firstfix.lab.scenarios.phases import CarryTo, DriveTo, Phase, Slip, Stand, Teleport
from firstfix.lab.scenarios.scenario import Scenario, run
from firstfix.lab.simulation.recorder import record

KINDS = ["teleport", "carry", "teleport_driving", "crowd_teleport", "slip", "crowd", "nothing"]


def test_kinds_take_turns_and_begin_with_standing() -> None:
    scripts = [scripted(seed) for seed in range(14)]
    assert [kind for kind, _ in scripts] == 2 * KINDS
    assert all(isinstance(phases[0], Stand) for _, phases in scripts)


def test_every_disturbance_has_time_after_it() -> None:
    for seed in range(7):
        _, phases = scripted(seed)
        for i, phase in enumerate(phases):
            if isinstance(phase, Teleport | CarryTo | Slip):
                rest = phases[i + 1 :]
                ends = [j for j, p in enumerate(rest) if isinstance(p, Teleport | CarryTo | Slip)]
                calm = rest[: ends[0]] if ends else rest
                assert sum(getattr(p, "seconds", 0.0) for p in calm) >= kidnap_scripts.AFTER_S


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_a_world_is_simulated_and_reported(
    cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kidnap_scripts, "_NOTHING_S", 20.0)
    arguments = ["--worlds", "house", "--scenarios", 2, "--seed", 5, "--jobs", 2]
    ended = cli("bench", "--kidnap", *arguments, "--out", "k.json", "--report", "out")
    assert ended.status == 0, ended
    assert ended.out.startswith("| world ")
    assert "| crowd " in ended.out
    document = json.loads((tmp_path / "k.json").read_text())
    (row,) = document["worlds"]
    assert (row["name"], row["scenarios"], row["kidnaps"]) == ("house", 2, 0)
    assert list(row["by_kind"]) == ["crowd", "nothing"]
    assert row["start_right"] + row["start_wrong"] <= 2
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "report.md",
        "time_to_recover.png",
    }


@pytest.fixture(scope="module")
def phases(hall_plan: OccupancyGrid) -> list[Phase]:
    done = [CarryTo(seconds=1.0), Stand(12.0), Slip(), Stand(1.0), Teleport(), Stand(12.0)]
    return [Stand(1.0), *done]


def test_the_disturbances_of_a_scenario_are_judged(
    hall_plan: OccupancyGrid, phases: list[Phase]
) -> None:
    moments = run(Scenario(phases), hall_plan, 1)
    instants = list(localized(simulated(moments), hall_plan))
    trial = judge_trial(instants)
    assert [a.kind for a in trial.aftermaths] == ["carry", "slip", "teleport"]
    carry, _, teleport = trial.aftermaths
    assert (carry.signalled, teleport.signalled) == (True, False)
    assert (carry.is_kidnap, teleport.is_kidnap) == (True, True)
    assert carry.left_after_s == 0.0
    assert carry.stamp == pytest.approx(2.0)
    held = [instant for instant in instants if 1.0 <= instant.stamp < 1.95]
    assert all(i.disturbed and not i.useful and i.published is None for i in held)
    assert all(instant.cpu_s >= 0.0 and instant.truth is not None for instant in instants)


@pytest.mark.slow
def test_a_spliced_drive_has_unsignalled_kidnaps(hall_plan: OccupancyGrid) -> None:
    recording = record(run(Scenario([DriveTo(seconds=15.0), DriveTo()] * 4), hall_plan, 2))
    thin = Recording(recording.scans[::4], recording.odometry, _rows(recording.truth))
    case = Case("hall", "hall", "sim", lambda: hall_plan, lambda: thin)
    result = KidnapCaseTask(case, (0,))()
    assert (result.name, result.left_out) == ("hall", None)
    (ran,) = result.runs
    assert (ran.kind, ran.seed) == ("splice", 0)
    assert [a.kind for a in ran.trial.aftermaths] == ["splice"] * 4
    assert all(a.is_kidnap and not a.signalled for a in ran.trial.aftermaths)


def _rows(truth: np.ndarray | None) -> np.ndarray | None:
    return None if truth is None else truth[::4]


@pytest.mark.usefixtures("in_this_process")
def test_cases_that_cannot_be_spliced_are_named(cli, drive: Path, cases: Path) -> None:
    ended = cli("bench", drive, "--kidnap", "--cases", cases / "unique", "--jobs", 2)
    assert (ended.status, ended.out) == (2, "")
    assert "drive (no drive of 20 s" in ended.err
    assert "unique (no odometry)" in ended.err
    assert ended.err.count("\n") == 1
