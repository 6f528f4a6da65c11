"""Case folders: ``map.yaml`` with its image, ``scans.npz``, and perhaps ``meta.json``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from firstfix.core.errors import InputError
from firstfix.io.logs.load import load_recording
from firstfix.io.maps.map_server import load_map
from firstfix.lab.experiments.case import Case


def find_cases(folders: Sequence[Path]) -> list[Case]:
    """List the cases in some folders; nothing but ``meta.json`` is read yet.

    Parameters
    ----------
    folders : sequence of Path
        Cases, or folders of cases.

    Returns
    -------
    list of Case
        In the order of the folders; those inside a folder by name.

    Raises
    ------
    InputError
        If a folder is no case and holds none, or a ``meta.json`` is broken.
    """
    return [_case(folder) for given in folders for folder in _case_folders(given)]


def _case_folders(given: Path) -> list[Path]:
    if _is_case(given):
        return [given]
    inside = sorted(p for p in given.iterdir() if _is_case(p)) if given.is_dir() else []
    if not inside:
        raise InputError(
            expected="a case: a folder with map.yaml and scans.npz, or a folder of such folders",
            received=f"{given}{'' if given.exists() else ' (there is none)'}",
            remedy="name the folder of a case",
        )
    return inside


def _is_case(folder: Path) -> bool:
    return (folder / "map.yaml").is_file() and (folder / "scans.npz").is_file()


def _case(folder: Path) -> Case:
    name = folder.resolve().name
    meta = _meta(folder / "meta.json")
    return Case(
        name=name,
        site=str(meta.get("site", name)),
        kind=str(meta.get("kind", "unknown")),
        grid=partial(load_map, folder / "map.yaml"),
        recording=partial(load_recording, folder / "scans.npz"),
    )


def _meta(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(
            expected=f"{path} as JSON",
            received=f"{type(error).__name__}: {error}",
            remedy="mend or remove it",
        ) from None
    if not isinstance(meta, dict):
        raise InputError(
            expected=f"{path} as a JSON object",
            received=type(meta).__name__,
            remedy='write {"site": ..., "kind": ...}',
        )
    return meta
