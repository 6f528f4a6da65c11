"""Recordings from ROS 1 and ROS 2 bags."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.bag_file import ODOMETRY, SCAN, TRANSFORMS, BagFile
from firstfix.io.logs.bag_points import KINDS, converter
from firstfix.io.logs.checks import (
    SORTED_AHEAD,
    ascending,
    check_count,
    check_max_scans,
    located,
    sorting_notes,
)
from firstfix.io.logs.given_frames import GivenFrames
from firstfix.io.ros_messages.incoming import (
    to_frame,
    to_laser_scan,
    to_odometry,
    to_seconds,
    to_transform,
)
from firstfix.io.ros_messages.sensor_place import SensorPlace, place_of, unknown_place
from firstfix.io.ros_messages.tf_tree import TransformTree

# How long after the last scan transforms are still read: they arrive later than the scan, and
# odometry is interpolated.
AFTER_LAST_SCAN_NS = 2_000_000_000


class _Sweep(NamedTuple):
    """A scan as it was recorded."""

    time_ns: int
    message: Any

    @property
    def stamp(self) -> float:
        """Seconds; the time of recording if the driver sends no stamp."""
        return to_seconds(self.message.header.stamp) or 1e-9 * self.time_ns


def load_bag(
    path: str | Path,
    *,
    topic: str | None = None,
    max_scans: int | None = None,
    given: GivenFrames = GivenFrames(),  # noqa: B008 - it is frozen
) -> Recording:
    """Read the scans of one topic, and the odometry, from a bag.

    Point clouds and depth images, whose topic has to be named, become scans by
    `firstfix.core.points.scan_from_points` with its default band of heights.

    The base is ``base_link``, else ``base_footprint``, else the frame that odometry moves,
    the first of them to which constant transforms (on ``/tf_static`` or, as in ROS 1, repeated on
    ``/tf``) connect the sensor. If there is none, the base is the sensor, odometry is omitted, and
    a note says so. Odometry is the transform from an odometry frame on ``/tf``,
    else ``nav_msgs/Odometry``. Poses that a localizer published are not used as ground truth.

    Parameters
    ----------
    path : str or Path
        A ``.bag``, ``.db3`` or ``.mcap`` file, or the folder of a ROS 2 bag.
    topic : str or None
        Topic of the scans; None for the only one, or ``scan`` if there are several.
    max_scans : int or None
        Only the first ones by stamp.
    given : GivenFrames
        Frames, and the pose of the sensor, where the transforms of the bag do not have them.

    Returns
    -------
    Recording
        Without truth; assumptions of the reader are in its notes.

    Raises
    ------
    ScanError
        If the bag is damaged, the topic is not unique, or a scan is invalid.
    """
    path = Path(path)
    n_most = check_max_scans(max_scans)
    with located(f"{path}"), BagFile(path) as bag:
        topic, kind = _scan_topic(bag, topic)
        if kind in KINDS:
            return _load_points(bag, topic, kind, n_most, given)
        messages = islice(bag.messages(SCAN, [topic]), n_most + SORTED_AHEAD)
        read = [_Sweep(*item) for item in messages]
        check_count(len(read), max_scans, path)
        if not read:
            raise _no_scan(topic)
        order = ascending(np.array([sweep.stamp for sweep in read]))
        sweeps = [read[i] for i in order[:n_most].tolist()]
        until_ns = None
        if len(sweeps) < len(read):
            until_ns = max(sweep.time_ns for sweep in sweeps) + AFTER_LAST_SCAN_NS
        tree = _transforms(bag, until_ns)
        frames = sorted({to_frame(sweep.message.header.frame_id) for sweep in sweeps})
        base, odometry, notes = _odometry(bag, tree, frames[0], given, until_ns)
        places = {frame: _place(tree, base, frame, frames, given) for frame in frames}
        return _recording(topic, sweeps, places, odometry, [*notes, *sorting_notes(order)])


def _scan_topic(bag: BagFile, topic: str | None) -> tuple[str, str]:
    """Return the topic and its type. Point clouds and depth images have to be named."""
    found = [(name, kind) for name, kind in bag.topics() if kind == SCAN]
    if topic is not None:
        usable = [(name, kind) for name, kind in bag.topics() if kind in (SCAN, *KINDS)]
        found = [(name, kind) for name, kind in usable if name.strip("/") == topic.strip("/")]
    elif len(found) > 1:
        found = [(name, kind) for name, kind in found if name.strip("/") == "scan"]
    if len(found) == 1:
        return found[0]
    listed = ", ".join(f"{name} ({kind})" for name, kind in bag.topics())
    raise ScanError(
        expected=f"a topic of {SCAN}" if topic is None else f"{SCAN} on the topic {topic}",
        received=f"the topics {listed or '(none)'}",
        remedy="name one topic of scans, point clouds or depth images",
    )


def _no_scan(topic: str) -> ScanError:
    return ScanError(
        expected=f"scans on {topic}, as in the index of the bag",
        received="none",
        remedy="reindex the bag, or record it again",
    )


def _load_points(bag: BagFile, topic: str, kind: str, n_most: int, given: GivenFrames) -> Recording:
    """Read point clouds or depth images, one at a time: together they may not fit into memory."""
    if given.T_base_laser is not None:
        raise ScanError(
            f"The height of a sensor counts on {topic}, and --laser-pose has none. Leave it out, "
            "and record the static transforms."
        )
    tree = _transforms(bag, None)
    first = next(bag.messages(kind, [topic]), None)
    if first is None:
        raise _no_scan(topic)
    frame = to_frame(given.laser or first[1].header.frame_id)
    base, odometry, notes = _odometry(bag, tree, frame, given, None)
    T_base_sensor = None if base is None else tree.fixed(base, frame)
    if T_base_sensor is None:
        raise ScanError(
            f"No fixed transforms lead from the base to {frame}, so the heights of points on "
            f"{topic} are unknown. Record the static transforms, or name frames by --base-frame "
            "and --laser-frame."
        )
    convert = converter(bag, topic, kind, T_base_sensor, given.band)
    scans = []
    for i, item in enumerate(islice(bag.messages(kind, [topic]), n_most + SORTED_AHEAD)):
        sweep = _Sweep(*item)
        with located(f"message {i} on {topic}"):
            scans.append(convert(sweep.message, sweep.stamp))
    order = ascending(np.array([scan.stamp for scan in scans]))
    return Recording(
        scans=tuple(scans[i] for i in order[:n_most].tolist()),
        odometry=odometry,
        notes=(*notes, *sorting_notes(order)),
    )


def _transforms(bag: BagFile, until_ns: int | None) -> TransformTree:
    tree = TransformTree()
    names = bag.topics_of(TRANSFORMS)
    static = [name for name in names if name.endswith("tf_static")]
    moving = [name for name in names if name not in static]
    for some, end_ns in ((static, None), (moving, until_ns)):
        for _, message in bag.messages(TRANSFORMS, some, until_ns=end_ns):
            tree.add(map(to_transform, message.transforms))
    return tree


def _odometry(
    bag: BagFile, tree: TransformTree, frame: str, given: GivenFrames, until_ns: int | None
) -> tuple[str | None, Trajectory | None, list[str]]:
    base = _base(tree, frame, given)
    odometry = None if base is None else tree.odometry(base)
    names = bag.topics_of(ODOMETRY)
    if odometry is not None or not names:
        return base, odometry, []
    # Two filters on two topics may use the same frames: their trajectories must not be mixed.
    name = next((name for name in names if name.strip("/") == "odom"), names[0])
    messages = bag.messages(ODOMETRY, [name], until_ns=until_ns)
    tree.add_odometry(to_odometry(message) for _, message in messages)
    base = _base(tree, frame, given)
    odometry = None if base is None else tree.odometry(base)
    if odometry is None:
        return base, None, [f"{name} has no frame that is rigidly connected to the sensor"]
    return base, odometry, [f"odometry is from {name}, because no transform contains it"]


def _base(tree: TransformTree, frame: str, given: GivenFrames) -> str | None:
    if given.base is not None:
        return to_frame(given.base)
    if given.T_base_laser is not None:
        return next(iter(tree.bases()), None)
    return tree.base_of(given.laser or frame)


def _place(
    tree: TransformTree, base: str | None, frame: str, frames: list[str], given: GivenFrames
) -> SensorPlace:
    if given.T_base_laser is not None:
        return SensorPlace(given.T_base_laser, given.mounting)
    frame = to_frame(given.laser or frame)
    T = None if base is None else tree.fixed(base, frame)
    if T is not None:
        return place_of(frame, T)
    if given.any:
        raise ScanError(
            expected=f"fixed transforms from {base or 'a base'} to {frame}",
            received="none in the bag",
            remedy="check the names of the frames, or give the pose of the sensor: --laser-pose",
        )
    if len(frames) == 1:
        return unknown_place(frame)
    raise ScanError(
        expected="scans of one sensor, or fixed transforms from one base to all of them",
        received=f"scans in the frames {', '.join(frames)}",
        remedy="choose another topic, or record the static transforms",
    )


def _recording(
    topic: str,
    sweeps: list[_Sweep],
    places: dict[str, SensorPlace],
    odometry: Trajectory | None,
    notes: list[str],
) -> Recording:
    scans: list[LaserScan] = []
    for i, sweep in enumerate(sweeps):
        place = places[to_frame(sweep.message.header.frame_id)]
        with located(f"scan {i} on {topic}"):
            scans.append(
                to_laser_scan(
                    sweep.message,
                    T_base_laser=place.T_base_laser,
                    mounting=place.mounting,
                    stamp=sweep.stamp,
                )
            )
    unstamped = sum(to_seconds(sweep.message.header.stamp) == 0.0 for sweep in sweeps)
    if unstamped:
        notes = [*notes, f"{unstamped} scan(s) have no stamp: the time of recording was taken"]
    placing = [note for place in places.values() for note in place.notes]
    return Recording(scans=tuple(scans), odometry=odometry, notes=(*placing, *notes))
