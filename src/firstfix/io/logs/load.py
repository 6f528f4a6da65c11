"""One function for recordings in every format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.core.arguments import as_member, as_pose
from firstfix.core.errors import ScanError
from firstfix.core.points import DEFAULT_BAND_M
from firstfix.core.recording import Recording
from firstfix.core.scan import Mounting
from firstfix.core.se2 import SE2
from firstfix.io.logs.given_frames import GivenFrames

BAG_SUFFIXES = (".bag", ".db3", ".mcap")
CARMEN_SUFFIXES = (".log", ".clf", ".carmen")


def load_recording(  # noqa: PLR0913 - each is a fact that a log may lack
    path: str | Path,
    *,
    topic: str | Sequence[str] | None = None,
    max_scans: int | None = None,
    T_base_laser: SE2 | tuple[float, float, float] | None = None,
    mounting: Mounting | str = Mounting.UPRIGHT,
    base_frame: str | None = None,
    laser_frame: str | None = None,
    height_band: tuple[float, float] = DEFAULT_BAND_M,
) -> Recording:
    """Read a recording in any supported format.

    Parameters
    ----------
    path : str or Path
        ``.npz``; ``.bag``; the folder of a ROS 2 bag, or its ``.db3`` or ``.mcap``; a CARMEN log
        ``.log``, ``.clf`` or ``.carmen``, also with ``.gz``.
    topic : str, sequence of str or None
        Topic of the scans in a bag, or of each of several sensors; FLASER, RLASER, ROBOTLASER1 in
        a CARMEN log; None to choose.
    max_scans : int or None
        Only the first ones by stamp, of each sensor.
    T_base_laser : SE2, optional
        Pose of the sensor on the robot, for a bag whose transforms do not have it.
    mounting : Mounting or str
        Which way up it is then.
    base_frame, laser_frame : str, optional
        Frames of the robot and of the sensor, where those that a bag states are wrong.
    height_band : tuple of float
        Lowest and highest height above the base of points that are used, m, for point clouds and
        depth images.

    Returns
    -------
    Recording
        Scans, and odometry and truth if the file has them; assumptions of the reader are in its
        notes.

    Raises
    ------
    ScanError
        If there is no readable recording at the path, or frames are given for a format without.

    Examples
    --------
    >>> ff.save_recording(ff.Recording((scan,)), "scans.npz")
    >>> ff.load_recording("scans.npz")
    <Recording 1 scans in 0.0 s>
    """
    path = Path(path)
    pose = None if T_base_laser is None else as_pose(T_base_laser, "T_base_laser")
    which_way = as_member(Mounting, mounting, "mounting")
    given = GivenFrames(pose, which_way, base_frame, laser_frame, height_band)
    topics = (topic,) if topic is None or isinstance(topic, str) else tuple(topic) or (None,)
    if len(topics) == 1:
        return _load(path, topics[0], max_scans, given)
    if given.T_base_laser is not None or given.laser is not None:
        raise ScanError(
            expected=f"one topic with the pose or the frame of its sensor in {path}",
            received=f"{len(topics)} topics",
            remedy="leave the pose out, or name one topic",
        )
    return _together([_load(path, each, max_scans, given) for each in topics])


def _together(recordings: Sequence[Recording]) -> Recording:
    """Put the recordings of several sensors of one robot in the order of their stamps."""
    scans = [scan for recording in recordings for scan in recording.scans]
    sensors = np.repeat(np.arange(len(recordings)), [len(recording) for recording in recordings])
    order = np.argsort([scan.stamp for scan in scans], kind="stable")
    return Recording(
        scans=tuple(replace(scans[i], sensor=str(sensors[i])) for i in order),
        odometry=max((r.odometry for r in recordings if r.odometry), key=len, default=None),
        sensors=sensors[order],
        notes=tuple(dict.fromkeys(note for recording in recordings for note in recording.notes)),
    )


def _load(path: Path, topic: str | None, max_scans: int | None, given: GivenFrames) -> Recording:
    suffix = _suffix(path)
    # Imported here because rosbags takes a tenth of a second.
    if suffix in BAG_SUFFIXES or suffix == "/":
        from firstfix.io.logs.bag import load_bag

        return load_bag(path, topic=topic, max_scans=max_scans, given=given)
    if given.any:
        raise ScanError(
            expected=f"no frames and no pose of the sensor for {path}",
            received="one of them",
            remedy="leave them out: only bags need them",
        )
    if suffix in CARMEN_SUFFIXES:
        from firstfix.io.logs.carmen import load_carmen

        return load_carmen(path, kind=topic, max_scans=max_scans)
    if topic is not None:
        raise ScanError(
            expected=f"no topic for {path}",
            received=f"{topic!r}",
            remedy="leave it out: an .npz file holds the scans of one sensor",
        )
    from firstfix.io.logs.npz import load_npz

    return load_npz(path, max_scans=max_scans)


def _suffix(path: Path) -> str:
    """Return the suffix that selects the reader, "/" for the folder of a bag."""
    if path.is_dir():
        return _check_bag_folder(path)
    if not path.exists():
        raise _not_a_recording(f"no file {path}", "check the path")
    suffix = path.suffix.lower()
    inner = Path(path.stem).suffix.lower()
    if suffix == ".gz" and inner in CARMEN_SUFFIXES:
        return inner
    if suffix in (*BAG_SUFFIXES, *CARMEN_SUFFIXES, ".npz"):
        return suffix
    remedy = "convert it, or give the right suffix to a file of one of these kinds"
    if suffix == ".active":
        remedy = "run `rosbag reindex` on it: its recording was not finished"
    raise _not_a_recording(f"{path}", remedy)


def _check_bag_folder(path: Path) -> str:
    if (path / "metadata.yaml").exists():
        return "/"
    inside = sorted(p.name for p in path.iterdir() if p.suffix.lower() in (".db3", ".mcap", ".npz"))
    remedy = f"give {path / inside[0]} itself" if inside else "give the file itself"
    raise _not_a_recording(f"the folder {path} without a metadata.yaml", remedy)


def _not_a_recording(received: str, remedy: str) -> ScanError:
    return ScanError(
        expected="a recording: .npz, .bag, a ROS 2 bag (folder, .db3, .mcap) or a CARMEN .log",
        received=received,
        remedy=remedy,
    )
