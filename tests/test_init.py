"""The public names: a short, sorted list, and quick to import."""

import subprocess
import sys

import pytest

import firstfix

PUBLIC = [
    "Evidence",
    "FirstfixError",
    "Hypothesis",
    "InputError",
    "LaserScan",
    "Localizer",
    "LocalizerConfig",
    "LocateConfig",
    "LocateResult",
    "MapError",
    "Method",
    "Mounting",
    "NewMap",
    "OccupancyGrid",
    "Odometry",
    "Recording",
    "SE2",
    "ScanError",
    "ScanMatcher",
    "SearchReport",
    "Trajectory",
    "Verdict",
    "load_map",
    "load_recording",
    "save_map",
]


def test_the_public_names_are_these_sorted_and_few() -> None:
    assert firstfix.__all__ == PUBLIC
    assert sorted(PUBLIC) == PUBLIC


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_is_there_and_lives_where_it_says(name: str) -> None:
    thing = getattr(firstfix, name)
    assert thing.__name__ == name
    assert thing.__module__.startswith("firstfix.")
    assert getattr(firstfix, name) is thing


def test_every_public_name_is_listed() -> None:
    assert set(PUBLIC) <= set(dir(firstfix))


def test_another_name_is_none() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Localiser'"):
        _ = firstfix.Localiser  # type: ignore[attr-defined]


def test_importing_the_package_loads_nothing_heavy() -> None:
    # What is loaded says more than a stopwatch on a busy machine.
    script = "import firstfix, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"numpy", "numba", "matplotlib", "rosbags", "rich", "typer", "yaml", "PIL"}
    assert not heavy & set(loaded)
