"""Options of ``locate`` and ``track`` that replace missing data of a log."""

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.cli.sensor_options import _parsed
from firstfix.core.errors import InputError
from firstfix.io.logs.tum import load_trajectory


def test_a_pose_of_a_sensor_is_three_or_four_numbers() -> None:
    assert _parsed("0.2,0,1.57") == ((0.2, 0.0, 1.57), False)
    assert _parsed("0.2,-1e-1,1.57,3.14") == ((0.2, -0.1, 1.57), True)
    assert _parsed("0,0,0,-3.1") == ((0.0, 0.0, 0.0), True)
    assert _parsed("0,0,0,0.1") == ((0.0, 0.0, 0.0), False)


@pytest.mark.parametrize("text", ["", "1,2", "1,2,x", "nan,0,0", "0,0,0,1.57", "0,0,0,0,0", "inf"])
def test_another_text_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(InputError, match=r"is not a pose\. Write X,Y,YAW"):
        _parsed(text)


def test_a_bad_pose_ends_with_2_and_one_line(cli, drive: Path) -> None:
    for command in ("locate", "track"):
        ended = cli(command, drive / "map.yaml", drive / "scans.npz", "--laser-pose", "1,2")
        assert (ended.status, ended.err.count("\n")) == (2, 1)
        assert "--laser-pose 1,2 is not a pose" in ended.err


@pytest.mark.slow
@pytest.mark.shared
def test_a_real_bag_without_transforms_is_tracked(cli, shared: Path) -> None:
    """A race car at 1.9 m/s in a map that is years older; odometry is a topic of its own."""
    folder = shared / "drives" / "stata_basement"
    files = folder / "stata_basement.yaml", folder / "drive.bag"
    ended = cli(
        "track", *files, "--laser-pose", "0,0,0", "--start", "search", "--out", "a.tum", "--json"
    )
    assert ended.status == 0, ended.err
    assert json.loads(ended.out)["scans"] > 180
    poses = load_trajectory("a.tum").poses
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert steps.max() < 0.3  # no jump to another place
    assert 3.0 < steps.sum() < 9.0
