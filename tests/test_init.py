"""The public names: a sorted list that follows use, quick to import."""

import subprocess
import sys

import pytest

import firstfix

PUBLIC = [
    "All",
    "AmclConfig",
    "AnyOf",
    "Change",
    "ChangeCounter",
    "ChangesConfig",
    "Event",
    "Evidence",
    "FirstfixError",
    "Gaussian",
    "Hypotheses",
    "Hypothesis",
    "InitialPose",
    "InputError",
    "LaserScan",
    "Lidar",
    "Localizer",
    "LocalizerConfig",
    "LocateConfig",
    "LocateResult",
    "MapChanges",
    "MapError",
    "MapHint",
    "MapSwitched",
    "Method",
    "MonitorConfig",
    "MotionModel",
    "MotionRequest",
    "Mounting",
    "Near",
    "NewMap",
    "NoMotionUpdate",
    "OccupancyGrid",
    "Odometry",
    "PoseHint",
    "PositionFix",
    "Recording",
    "Region",
    "Reset",
    "SE2",
    "ScanError",
    "ScanMatcher",
    "ScansConfig",
    "SearchReport",
    "SensorModel",
    "Signal",
    "SignalKind",
    "Site",
    "SiteLocalizer",
    "SiteResult",
    "State",
    "Status",
    "TrackedPose",
    "Trajectory",
    "Verdict",
    "deskew",
    "find_changes",
    "load_map",
    "load_recording",
    "load_trajectory",
    "points_from_depth",
    "precompile",
    "save_map",
    "save_recording",
    "save_trajectory",
    "scan_from_points",
    "simulate_drive",
]


def test_the_public_names_are_these_and_sorted() -> None:
    assert firstfix.__all__ == PUBLIC
    assert sorted(PUBLIC) == PUBLIC


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_can_be_imported(name: str) -> None:
    thing = getattr(firstfix, name)
    assert thing.__name__ == name
    assert thing.__module__.startswith("firstfix.")
    assert getattr(firstfix, name) is thing


def test_every_public_name_is_listed() -> None:
    assert set(PUBLIC) <= set(dir(firstfix))


def test_the_former_name_still_works_with_a_warning() -> None:
    with pytest.warns(DeprecationWarning, match=r"use firstfix\.ScanMatcher") as caught:
        assert firstfix.Locator is firstfix.ScanMatcher  # type: ignore[attr-defined]
    assert caught[0].filename == __file__
    assert "Locator" not in firstfix.__all__


def test_an_unknown_name_is_an_attribute_error() -> None:
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
