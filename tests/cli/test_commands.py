"""The other commands."""

import json
import sys
from pathlib import Path

import pytest

from firstfix import __version__
from firstfix.lab.scenarios.disturbances import CarryTo, Teleport
from firstfix.lab.scenarios.phases import Stand

Files = tuple[Path, Path]


def test_help_names_every_command(cli) -> None:
    ended = cli("--help")
    assert ended.status == 0
    for command in ("locate", "track", "bench", "map", "demo", "doctor"):
        assert command in ended.out
        assert cli(command, "--help").status == 0


@pytest.mark.parametrize(
    ("command", "default"),
    [
        (["locate"], "default: (0)"),
        (["bench"], "default: (fast)"),
        (["map", "show"], "default: (firstfix-NAME.png in this folder)"),
        (["map", "check"], "default: (40, none above 10 million cells)"),
    ],
)
def test_help_names_the_default_of_what_may_be_left_out(cli, command: list[str], default: str):
    # The box breaks lines anywhere.
    printed = " ".join(cli(*command, "--help").out.replace("│", " ").split())
    assert default in printed


def test_version(cli) -> None:
    assert cli("--version").out == f"firstfix {__version__}\n"


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_bench_compares_with_the_truth_and_writes_it_down(cli, cases: Path, tmp_path: Path) -> None:
    arguments = ["--wrong-map", "--jobs", 2, "--out", "out/bench.json", "--report", "out/report"]
    ended = cli("bench", cases, *arguments)
    assert ended.status == 0, ended
    document = json.loads((tmp_path / "out" / "bench.json").read_text())
    assert [row["name"] for row in document["cases"]] == ["alike", "unique"]
    assert [row["site"] for row in document["cases"]] == ["rooms", "hall"]
    unique = document["cases"][1]
    assert (unique["n"], unique["success"], unique["wrong_unique"]) == (3, 1.0, 0)
    assert unique["cpu_s"] > 0.0
    assert unique["rss_mb"] > 20.0
    assert document["total"]["n"] == document["wrong_map"]["n"] == 4
    assert (tmp_path / "out" / "report" / "report.md").read_text().startswith("# firstfix bench")
    assert "| unique " in ended.out
    assert "| scans of " in ended.out


@pytest.mark.slow
def test_bench_takes_single_cases_and_a_limit(cli, cases: Path, tmp_path: Path) -> None:
    ended = cli("bench", cases / "unique", "--limit", 1, "--wrong-map", "--out", "b.json")
    assert ended.status == 0
    document = json.loads((tmp_path / "b.json").read_text())
    assert document["total"]["n"] == 1
    assert document["wrong_map"] == {"n": 0, "unique": 0}
    assert "no scan was tried on a wrong map" in ended.err


def test_map_check_describes_a_map(cli, unique: Files) -> None:
    ended = cli("map", "check", unique[0])
    assert ended.status == 0
    for text in ("200 x 160 cells, 10.00 x 8.00 m", "0.05 m per cell", "no traps found"):
        assert text in ended.out


def test_map_check_warns_of_traps(cli, unique: Files, tmp_path: Path) -> None:
    text = unique[0].read_text().replace("mode: trinary\n", "")
    (tmp_path / "map.yaml").write_text(text.replace("resolution: 0.05", "resolution: 5.0"))
    for image in unique[0].parent.glob("*.pgm"):
        (tmp_path / image.name).write_bytes(image.read_bytes())
    ended = cli("map", "check", "map.yaml")
    assert ended.status == 0
    assert ended.out.count("warning: ") == 1  # to leave mode out is as good
    assert "warning: resolution 5.0 m is unusual" in ended.out


def test_map_check_finds_a_place_that_is_like_no_other(cli, unique: Files) -> None:
    ended = cli("map", "check", unique[0], "--samples", 5)
    assert ended.status == 0
    assert "5 random places" in ended.out
    assert "one place, right  100.0%" in ended.out
    assert "~" not in ended.out


def test_map_check_names_the_places_that_look_alike(cli, alike: Files) -> None:
    ended = cli("map", "check", alike[0], "--samples", 12, "--beams", 180, "--seed", 1)
    assert ended.status == 0
    assert "several places    100.0%" in ended.out
    (*pairs, rest) = ended.out[ended.out.index("~") :].splitlines()[1:]
    assert len(pairs) == 10
    assert rest == "and 2 more"
    for pair in pairs:
        here, there = (side.split() for side in pair.split("~"))
        assert abs(float(here[1]) - float(there[1])) == pytest.approx(8.0, abs=0.1)
        assert there[-1] == "50.0%"


def test_map_check_predicts_what_sensors_can_do(cli, unique: Files, tmp_path: Path) -> None:
    ended = cli(
        "map", "check", unique[0], "--samples", 2, "--sensor", "360,8", "--sensor", "two-lasers",
        "--plot", "heat.png",
    )  # fmt: skip
    assert ended.status == 0, ended
    assert "360° x 8 m, at 2 random places (seed 0)" in ended.out
    assert "two lasers, 270° x 8 m each, at 2 random places" in ended.out
    assert ended.out.count("one turn in place") == 2
    assert (tmp_path / "heat.png").exists()


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--sensor", "60"], "no sensor"),
        (["--sensor", "60,5", "--samples", 0], "needs places"),
        (["--plot", "heat.doc"], ".png"),
    ],
)
def test_map_check_refuses(cli, unique: Files, options: list[str], word: str) -> None:
    ended = cli("map", "check", unique[0], *options)
    assert ended.status == 2
    assert word in ended.err


def test_map_check_asks_before_it_works_long(
    cli, unique: Files, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firstfix.cli.map.MOST_CELLS", 1000)
    assert "Ask for it with --samples 40" in cli("map", "check", unique[0]).out
    assert "2 random places" in cli("map", "check", unique[0], "--samples", 2).out
    assert cli("map", "check", unique[0], "--samples", 0).out.endswith("no traps found\n")


@pytest.mark.parametrize(("grey", "word"), [(205, "free"), (254, "occupied")])
def test_map_check_of_a_map_with_nothing_in_it(cli, tmp_path: Path, grey: int, word: str) -> None:
    text = "image: blank.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\nmode: trinary\n"
    text += "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (tmp_path / "blank.yaml").write_text(text)
    (tmp_path / "blank.pgm").write_bytes(b"P5 40 40 255\n" + bytes([grey]) * 1600)
    ended = cli("map", "check", "blank.yaml")
    assert (ended.status, ended.err) == (0, "")
    assert "warning: " in ended.out
    printed = ended.out.splitlines()[-1]
    assert printed.startswith("Perceptual aliasing cannot be measured: ")
    assert word in printed


@pytest.mark.slow
def test_map_show_marks_what_looks_alike(cli, alike: Files, tmp_path: Path) -> None:
    for name, options in (("plain.png", []), ("marked.png", ["--aliasing", "--samples", 4])):
        assert cli("map", "show", alike[0], "--plot", name, *options).status == 0
    assert (tmp_path / "marked.png").read_bytes() != (tmp_path / "plain.png").read_bytes()


def test_map_show_draws_here_and_never_over_the_map(cli, unique: Files, tmp_path: Path) -> None:
    ended = cli("map", "show", unique[0])
    assert ended.status == 0
    assert (tmp_path / "firstfix-map.png").exists()
    assert str(tmp_path / "firstfix-map.png") in ended.err


def test_maps_are_described_for_programs(cli, alike: Files, tmp_path: Path) -> None:
    ended = cli("map", "check", alike[0], "--samples", 4, "--beams", 180, "--json")
    document = json.loads(ended.out)
    assert document["cells"] == [round(side / 0.05) for side in document["size_m"]]
    assert document["warnings"] == []
    assert document["aliasing"]["several_places"] == 1.0
    pair = document["aliasing"]["pairs"][0]
    assert abs(pair["pose"][0] - pair["other"][0]) == pytest.approx(8.0, abs=0.1)
    shown = json.loads(cli("map", "show", alike[0], "--plot", "map.svg", "--json").out)
    assert shown["cells"] == document["cells"]
    assert Path(shown["picture"]) == tmp_path / "map.svg"


def test_predictions_are_there_for_programs(cli, unique: Files) -> None:
    sensor = ("--samples", 1, "--sensor", "360,8", "--sensor", "skewed-lidar")
    document = json.loads(cli("map", "check", unique[0], *sensor, "--json").out)
    assert document["aliasing"] is None
    first, skewed = document["predictions"]
    assert first["sensor"] == "360° x 8 m"
    for found in (first, skewed):
        for effort in ("scan", "turn", "metre"):
            total = sum(found[answer][effort] for answer in ("right", "wrong", "open"))
            assert total == pytest.approx(1.0)


@pytest.fixture
def short_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the robot of the demo stand and be kidnapped twice: seconds instead of minutes."""
    phases = (Stand(1.0), CarryTo(seconds=1.0), Stand(1.0), Teleport(), Stand(3.0))
    monkeypatch.setattr("firstfix.lab.scenarios.demo.SCRIPT", phases)


@pytest.mark.slow
def test_the_demo_finds_and_tracks_the_robot_three_times(cli, tmp_path: Path) -> None:
    ended = cli("demo", "--world", "house", "--headless", "--seed", 3)
    assert (ended.status, ended.err) == (0, ""), ended
    for words in ("Building", "wakes up", "carries it", "teleported", "by the first scan"):
        assert words in ended.out
    assert ended.out.count("Tracked: ") == 3
    assert "Live page  run " in ended.out
    assert "found again" in ended.out.splitlines()[-1]
    assert (tmp_path / "firstfix-demo.png").stat().st_size > 5000


@pytest.mark.slow
@pytest.mark.usefixtures("short_scenario")
def test_in_identical_rooms_the_demo_publishes_nothing_and_that_is_correct(cli) -> None:
    ended = cli("demo", "--world", "rooms", "--headless", "--seed", 3)
    assert (ended.status, ended.err) == (0, "")
    sentence = "AMBIGUOUS: 4 identical rooms, 25 % each; published nothing. Correct."
    assert ended.out.count(sentence) == 3
    assert "correct" in ended.out.splitlines()[-1]


@pytest.mark.slow
@pytest.mark.usefixtures("short_scenario")
def test_the_demo_for_programs(cli, tmp_path: Path) -> None:
    ended = cli("demo", "--world", "house", "--headless", "--seed", 3, "--json")
    document = json.loads(ended.out)
    assert (ended.status, document["succeeded"]) == (0, True)
    assert [episode["wrong_finds"] for episode in document["episodes"]] == [0, 0, 0]
    assert document["episodes"][0]["found_error"]["m"] < 0.1
    assert Path(document["picture"]) == tmp_path / "firstfix-demo.png"
    ended = cli("demo", "--json")
    assert (ended.status, ended.err.count("\n")) == (2, 1)
    assert "--headless" in ended.err


@pytest.mark.slow
@pytest.mark.usefixtures("short_scenario")
def test_a_demo_with_a_wrong_pose_fails(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firstfix.lab.scenarios.demo.is_found", lambda *_: False)
    ended = cli("demo", "--world", "house", "--headless", "--seed", 3)
    assert ended.status == 1
    assert "WRONG: found " in ended.out
    assert "failed" in ended.out.splitlines()[-1]


@pytest.mark.usefixtures("short_scenario")
def test_the_demo_without_matplotlib_has_no_picture(
    cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    ended = cli("demo", "--headless", "--world", "house", "--seed", 3)
    assert (ended.status, ended.err) == (0, "")
    assert "pip install 'firstfix[plot]'" in ended.out
    assert "found" in ended.out.splitlines()[-1]
    assert not (tmp_path / "firstfix-demo.png").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("short_scenario")
def test_the_demo_takes_a_map_of_ones_own(cli, unique: Files) -> None:
    assert cli("demo", "--headless", "--world", unique[0], "--plot", "own.svg").status in (0, 1)
    assert Path("own.svg").exists()


def test_the_doctor_prints_what_is_installed(cli) -> None:
    ended = cli("doctor")
    assert ended.status == 0
    for word in ("firstfix", "python", "numpy", "numba", "matplotlib", "cache", "kernels", "ROS"):
        assert f"\n{word}" in f"\n{ended.out}"
    assert "ready after" in ended.out


def test_the_doctor_reports_to_programs(cli, unique: Files) -> None:
    document = json.loads(cli("doctor", unique[0], "--json").out)
    assert document["works"] is True
    assert {"firstfix", "python", "numpy", "kernels", "map", "ROS"} <= set(document["report"])
    assert "no traps" in document["report"]["map"]


def test_map_check_says_when_a_sensor_needs_a_second_view(cli, unique: Files) -> None:
    ended = cli("map", "check", unique[0], "--samples", 3, "--fov", 180, "--range", 8)
    assert "one place, right" in ended.out
    assert "One scan of this sensor is never UNIQUE" in ended.out
