"""A case for the benchmarks from a map, a log and true poses."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.core.trajectory import Trajectory
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map

# A robot may turn on the spot between two poses that are farther apart in time.
_LONGEST_GAP_S = 0.5


def with_truth(recording: Recording, poses: Trajectory | None) -> tuple[Recording, int]:
    """Return a recording with the truth at its scans.

    Parameters
    ----------
    recording : Recording
        The scans.
    poses : Trajectory or None
        ``T_map_base`` over time, interpolated over gaps of at most 0.5 s; None keeps the truth of
        the recording.

    Returns
    -------
    Recording
        With NaN where the truth is unknown.
    int
        Number of scans whose truth is known.

    Raises
    ------
    InputError
        If no scan has a true pose.
    """
    if poses is not None:
        truth = [_pose_at(poses, scan.stamp) for scan in recording.scans]
        recording = replace(recording, truth=np.array(truth))
    known = recording.truth is not None and np.isfinite(recording.truth).all(axis=1)
    if not np.any(known):
        raise InputError(_without_truth(recording, poses))
    return recording, int(np.count_nonzero(known))


def write_case(
    grid: OccupancyGrid, recording: Recording, folder: Path, *, site: str, kind: str
) -> None:
    """Write map.yaml with its image, scans.npz and meta.json into a new folder, or nothing.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    recording : Recording
        Scans of one sensor, with truth.
    folder : Path
        It must not exist; its parents are made.
    site, kind : str
        For meta.json.

    Raises
    ------
    InputError
        If the folder exists or cannot be written, or there are scans of several sensors.
    """
    if folder.exists():
        raise InputError(f"{folder} exists. Choose a new folder, or remove it first.")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".case-", dir=folder.parent))
        try:
            save_map(grid, draft / "map.yaml")
            save_recording(recording, draft / "scans.npz")
            meta = json.dumps({"site": site, "kind": kind}, ensure_ascii=False)
            (draft / "meta.json").write_text(meta + "\n", encoding="utf-8")
            draft.chmod(0o755)
            draft.rename(folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be written ({error.strerror}).") from None


def _pose_at(poses: Trajectory, stamp: float) -> np.ndarray:
    after = int(np.searchsorted(poses.stamps, stamp))
    is_exact = after < len(poses) and poses.stamps[after] == stamp
    is_inside = 0 < after < len(poses)
    gap = poses.stamps[after] - poses.stamps[after - 1] if is_inside else np.inf
    pose = poses.at(stamp) if is_exact or gap <= _LONGEST_GAP_S else None
    return np.full(3, np.nan) if pose is None else pose.as_array()


def _without_truth(recording: Recording, poses: Trajectory | None) -> str:
    if poses is None:
        return "The log has no true poses. Pass them with --truth FILE in the TUM format."
    first, last = recording.scans[0].stamp, recording.scans[-1].stamp
    return (
        f"No scan has a true pose: the scans are from {first:.1f} s to {last:.1f} s, the "
        f"{len(poses)} poses from {poses.stamps[0]:.1f} s to {poses.stamps[-1]:.1f} s. Check that "
        "both use one clock."
    )
