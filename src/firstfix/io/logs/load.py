"""One function for recordings in every format."""

from __future__ import annotations

from pathlib import Path

from firstfix.core.errors import ScanError
from firstfix.core.recording import Recording

BAG_SUFFIXES = (".bag", ".db3", ".mcap")
CARMEN_SUFFIXES = (".log", ".clf", ".carmen")


def load_recording(
    path: str | Path, *, topic: str | None = None, max_scans: int | None = None
) -> Recording:
    """Read a recording in any supported format.

    Parameters
    ----------
    path : str or Path
        ``.npz``; ``.bag``; the folder of a ROS 2 bag, or its ``.db3`` or ``.mcap``; a CARMEN log
        ``.log``, ``.clf`` or ``.carmen``, also with ``.gz``.
    topic : str or None
        Topic of the scans in a bag, or FLASER, RLASER, ROBOTLASER1 in a CARMEN log; None to
        choose.
    max_scans : int or None
        Only the first ones by stamp.

    Returns
    -------
    Recording
        Scans, and odometry and truth if the file has them; assumptions of the reader are in its
        notes.

    Raises
    ------
    ScanError
        If there is no readable recording at the path.

    Examples
    --------
    >>> ff.save_recording(ff.Recording((scan,)), "scans.npz")
    >>> ff.load_recording("scans.npz")
    <Recording 1 scans in 0.0 s>
    """
    path = Path(path)
    suffix = _suffix(path)
    # Imported here because rosbags takes a tenth of a second.
    if suffix in BAG_SUFFIXES or suffix == "/":
        from firstfix.io.logs.bag import load_bag

        return load_bag(path, topic=topic, max_scans=max_scans)
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
