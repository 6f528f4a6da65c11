"""The file with the last pose, and how often it is written."""

import errno
from pathlib import Path

import numpy as np
import pytest

from firstfix.adapters.pose_keeper import PoseKeeper
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.formats.saved_pose import SavedPose, load_pose


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
def test_without_a_rate_a_pose_is_written_where_it_is_told_to(file, rate_hz):
    assert offered(file, rate_hz, [0.0, 1e3, 1e6]) == []
    PoseKeeper(file, rate_hz).save(pose_at(5.0))
    assert load_pose(file).stamp == 5.0


def test_a_clock_set_back_begins_the_pause_anew(file):
    assert offered(file, 1.0, [100.0, 101.0, 5.0, 5.5, 6.0]) == [101.0, 6.0]


def test_a_pose_saved_at_once_begins_the_pause_anew(file):
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


def test_what_cannot_be_written_or_removed_is_an_error_of_ours(tmp_path):
    folder = PoseKeeper(tmp_path, 1.0)
    for act in (lambda: folder.save(pose_at(1.0)), folder.withdraw):
        with pytest.raises(InputError):
            act()
    with pytest.raises(InputError):
        PoseKeeper(tmp_path / "no" / "folder.json", 1.0).save(pose_at(1.0))
    assert PoseKeeper(tmp_path / "no" / "folder.json", 1.0).withdraw() is None
    assert PoseKeeper(Path("nul\0"), 1.0).withdraw() is None


def test_a_full_disk_leaves_the_old_pose(file, monkeypatch):
    keeper = PoseKeeper(file, 1.0)
    keeper.save(pose_at(1.0))

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="No space left on device"):
        keeper.save(pose_at(2.0))
    assert load_pose(file).stamp == 1.0
    assert [path.name for path in file.parent.iterdir()] == [file.name]
