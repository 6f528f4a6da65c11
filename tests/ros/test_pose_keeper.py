"""The file with the last pose, and how often it is written."""

from pathlib import Path

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import SavedPose, load_pose
from firstfix.ros.pose_memory import PoseKeeper


def pose_at(stamp):
    return SavedPose(SE2(stamp, 0.0, 0.0), np.eye(3), stamp, SE2.identity(), "hall")


@pytest.fixture
def file(tmp_path):
    return tmp_path / "pose.json"


def offered(file, rate_hz, stamps):
    """Offer poses of these times; return at which of them the file changed."""
    keeper, written = PoseKeeper(file, rate_hz), []
    for stamp in stamps:
        before = file.read_bytes() if file.exists() else b""
        keeper.offer(pose_at(stamp))
        if file.exists() and file.read_bytes() != before:
            written.append(stamp)
    return written


def test_poses_are_written_at_the_rate(file):
    stamps = [10.0 + 0.25 * i for i in range(20)]
    assert offered(file, 1.0, stamps) == [11.0, 12.0, 13.0, 14.0]
    assert load_pose(file).T_map_base == SE2(14.0, 0.0, 0.0)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0])
def test_without_a_rate_a_pose_is_written_on_request(file, rate_hz):
    assert offered(file, rate_hz, [0.0, 1e3, 1e6]) == []
    PoseKeeper(file, rate_hz).save(pose_at(5.0))
    assert load_pose(file).stamp == 5.0


def test_a_clock_set_back_restarts_the_interval(file):
    assert offered(file, 1.0, [100.0, 101.0, 5.0, 5.5, 6.0]) == [101.0, 6.0]


def test_a_pose_saved_at_once_restarts_the_interval(file):
    keeper = PoseKeeper(file, 1.0)
    keeper.save(pose_at(10.0))
    keeper.offer(pose_at(10.5))
    assert load_pose(file).stamp == 10.0


def test_a_pose_can_be_withdrawn_whether_there_is_one_or_not(file):
    keeper = PoseKeeper(file, 1.0)
    keeper.withdraw()
    keeper.save(pose_at(1.0))
    keeper.withdraw()
    assert not file.exists()


def test_a_file_that_cannot_be_written_or_removed_is_an_error_of_ours(tmp_path):
    folder = PoseKeeper(tmp_path, 1.0)
    for act in (lambda: folder.save(pose_at(1.0)), folder.withdraw):
        with pytest.raises(InputError):
            act()
    with pytest.raises(InputError):
        PoseKeeper(tmp_path / "no" / "folder.json", 1.0).save(pose_at(1.0))
    assert PoseKeeper(tmp_path / "no" / "folder.json", 1.0).withdraw() is None
    assert PoseKeeper(Path("nul\0"), 1.0).withdraw() is None


def test_a_full_disk_leaves_the_old_pose(file, full_after):
    keeper = PoseKeeper(file, 1.0)
    keeper.save(pose_at(1.0))
    with full_after(100), pytest.raises(InputError, match="File too large"):
        keeper.save(pose_at(2.0))
    assert load_pose(file).stamp == 1.0
    assert [path.name for path in file.parent.iterdir()] == [file.name]
    keeper.offer(pose_at(3.0))
    assert load_pose(file).stamp == 3.0


READ_ONLY = """
import subprocess, sys
from pathlib import Path
import numpy as np
from firstfix.ros.pose_memory import PoseKeeper
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.io.saved_pose import SavedPose, load_pose

disk = Path(sys.argv[1])
keeper = PoseKeeper(disk / "pose.json", 1.0)
at = lambda stamp: SavedPose(SE2(stamp, 0.0, 0.0), np.eye(3), stamp, SE2.identity(), "hall")
keeper.save(at(1.0))
subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
for step in (lambda: keeper.save(at(2.0)), keeper.withdraw, lambda: keeper.offer(at(9.0))):
    try:
        step()
    except InputError as error:
        assert "Read-only file system" in str(error), error
    else:
        raise AssertionError("it was not refused")
    assert load_pose(disk / "pose.json").stamp == 1.0
subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
keeper.withdraw()
assert list(disk.iterdir()) == []
"""


def test_a_disk_that_became_read_only_keeps_the_pose_and_is_reported(on_small_disk):
    on_small_disk(READ_ONLY)


def test_a_folder_in_place_of_the_file_is_unchanged(tmp_path):
    (tmp_path / "pose.json").mkdir()
    (tmp_path / "pose.json" / "inside").touch()
    keeper = PoseKeeper(tmp_path / "pose.json", 1.0)
    for step in (lambda: keeper.save(pose_at(1.0)), keeper.withdraw):
        with pytest.raises(InputError):
            step()
    assert [path.name for path in tmp_path.rglob("*")] == ["pose.json", "inside"]
