"""The front door for recordings."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from firstfix.core.errors import ScanError
from firstfix.io.logs.load import load_recording

LOG = "FLASER 2 1 1 0 0 0 0 0 0 1.0 host 1.0\nRLASER 1 1 0 0 0 0 0 0 1.0 host 1.0\n"


def write_bag(path: Path, plugin: StoragePlugin) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    message = types["sensor_msgs/msg/LaserScan"](
        header=types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=1, nanosec=0), frame_id="base_link"
        ),
        angle_min=0.0,
        angle_max=0.2,
        angle_increment=0.1,
        time_increment=0.0,
        scan_time=0.0,
        range_min=0.0,
        range_max=9.0,
        ranges=np.ones(3, np.float32),
        intensities=np.zeros(0, np.float32),
    )
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/scan", message.__msgtype__, typestore=store)
        for stamp in (1, 2):
            writer.write(connection, stamp, store.serialize_cdr(message, message.__msgtype__))
    return path


def write_npz(path: Path) -> Path:
    np.savez(
        path,
        ranges=np.ones((2, 3)),
        angle_min=0.0,
        angle_increment=0.1,
        range_min=0.0,
        range_max=9.0,
    )
    return path


@pytest.mark.parametrize("name", ["a.log", "a.clf", "a.carmen", "A.LOG", "a.b.carmen"])
def test_logs_are_known_by_their_suffix(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(LOG)
    assert len(load_recording(path).scans[0]) == 2
    assert len(load_recording(str(path), topic="RLASER").scans[0]) == 1


def test_archives_are_known_by_their_suffix(tmp_path: Path) -> None:
    path = write_npz(tmp_path / "a.npz")
    assert len(load_recording(path)) == 2
    assert len(load_recording(path, max_scans=1)) == 1
    with pytest.raises(ScanError, match="no topic"):
        load_recording(path, topic="/scan")


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_bags_are_known_by_their_folder_or_suffix(tmp_path: Path, plugin: StoragePlugin) -> None:
    folder = write_bag(tmp_path / "drive", plugin)
    assert len(load_recording(folder)) == 2
    inside = next(p for p in folder.iterdir() if p.suffix != ".yaml")
    assert len(load_recording(inside, topic="/scan", max_scans=1)) == 1


def test_a_bag_folder_without_metadata_names_the_file_to_give(tmp_path: Path) -> None:
    folder = write_bag(tmp_path / "drive", StoragePlugin.SQLITE3)
    (folder / "metadata.yaml").unlink()
    with pytest.raises(ScanError, match=r"without a metadata.yaml; give .*drive\.db3 itself"):
        load_recording(folder)


@pytest.mark.parametrize("name", ["a.txt", "a.gz", "a.csv.gz", "a", "a.db3.zstd", "scans.npy"])
def test_other_files_are_rejected(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(LOG)
    with pytest.raises(ScanError, match=r"a recording: \.npz, \.bag"):
        load_recording(tmp_path / name)


def test_missing_files_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(ScanError, match=r"no file .*check the path"):
        load_recording(tmp_path / "missing.bag")
    with pytest.raises(ScanError, match=r"the folder .* without a metadata"):
        load_recording(tmp_path)


def test_the_error_of_an_unfinished_ros1_bag_names_the_repair(tmp_path: Path) -> None:
    path = tmp_path / "a.bag.active"
    path.write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(ScanError, match="rosbag reindex"):
        load_recording(path)


@pytest.mark.parametrize("suffix", [".npz", ".bag", ".db3", ".mcap", ".log", ".log.gz"])
@pytest.mark.parametrize("content", [b"", b"not a recording", bytes(range(256)) * 64])
def test_wrong_bytes_under_a_valid_suffix_are_rejected(
    tmp_path: Path, suffix: str, content: bytes
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(ScanError):
        load_recording(path)


@pytest.mark.shared
@pytest.mark.parametrize(
    "name", ["bags/uob_trace0.bag", "bags/olin_ros2", "bags/intel.carmen.log.gz"]
)
def test_real_recordings_open(shared: Path, name: str) -> None:
    recording = load_recording(shared / name, max_scans=5)
    assert len(recording) == 5
    assert recording.odometry is not None
    # People and furniture aside, a robot indoors sees walls.
    assert all(len(scan.points()) > 50 for scan in recording.scans)
