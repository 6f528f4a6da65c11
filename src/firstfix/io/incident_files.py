"""Incidents in files: a folder of bounded size, and files that may come from strangers."""

from __future__ import annotations

import io
import json
import os
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import InputError
from firstfix.io.atomic_files import check_is_file, replace_file, show, unreachable

MOST_FILES = 20
MOST_FOLDER_BYTES = 200 * 2**20
MOST_BYTES = 256 * 2**20
"""Greatest size of a file, unpacked."""
_MOST_DOCUMENT_BYTES = 32 * 2**20

_TYPES = {
    "document": "u1",
    "arrays": "u1",
    "start_arrays": "u1",
    "cells": "i1",
    "unseen": "b1",
    "changed": "b1",
}
_NAME = re.compile(r"incident-(\d{8}T\d{9}Z)-([a-z-]{1,40})\.npz")
_TIME = "%Y%m%dT%H%M%S"

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class IncidentFile:
    """A file in a folder of incidents.

    Parameters
    ----------
    name : str
        Without its folder.
    saved_at : str
        ISO 8601, UTC.
    cause : str
        Why it was saved.
    bytes : int
        Its size.
    """

    name: str
    saved_at: str
    cause: str
    bytes: int


def incident_folder(named: str = "") -> Path:
    """Return the folder of incidents.

    Parameters
    ----------
    named : str, optional
        The parameter ``incident_folder``; empty: ``FIRSTFIX_INCIDENT_DIR``, or the user's folder
        for state.
    """
    import platformdirs

    named = named or os.environ.get("FIRSTFIX_INCIDENT_DIR", "")
    if named:
        return Path(named)
    return Path(platformdirs.user_state_dir("firstfix", appauthor=False)) / "incidents"


class IncidentFolder:
    """A folder that keeps the newest incidents.

    Parameters
    ----------
    path : Path
        Made at the first incident.
    most_files : int
        The oldest are removed when there are more.
    most_bytes : int
        The oldest are removed when all together are larger.
    """

    def __init__(
        self, path: Path, most_files: int = MOST_FILES, most_bytes: int = MOST_FOLDER_BYTES
    ) -> None:
        self.path = path
        self._most_files = most_files
        self._most_bytes = most_bytes

    def save(self, content: bytes, cause: str, at: datetime) -> str:
        """Write a file, completely or not at all, and remove the oldest.

        Parameters
        ----------
        content : bytes
            Of `packed`.
        cause : str
            Part of the name.
        at : datetime
            When it happened, with a time zone; part of the name.

        Returns
        -------
        str
            The name of the file.

        Raises
        ------
        InputError
            If the folder cannot be made or the file cannot be written.
        """
        at = at.astimezone(timezone.utc)
        words = re.sub(r"[^a-z]+", "-", cause.lower()).strip("-")[:40]
        name = f"incident-{at.strftime(_TIME)}{at.microsecond // 1000:03d}Z-{words}.npz"
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unreachable(self.path, error) from error
        replace_file(self.path / name, [content])
        self._remove_oldest(name)
        return name

    def files(self) -> list[IncidentFile]:
        """Return the incidents, newest first; nothing where the folder cannot be read."""
        found = []
        try:
            for path in self.path.iterdir():
                match = _NAME.fullmatch(path.name)
                if match and path.is_file() and not path.is_symlink():
                    found.append(_described(path, match))
        except OSError:
            pass
        return sorted(found, key=lambda file: file.name, reverse=True)

    def read(self, name: str) -> bytes | None:
        """Return the content of one of `files`; None if there is none of this name."""
        if name not in {file.name for file in self.files()}:
            return None
        try:
            return (self.path / name).read_bytes()
        except OSError:
            return None  # it was removed meanwhile

    def _remove_oldest(self, newest: str) -> None:
        total = 0
        for i, file in enumerate(self.files()):
            total += file.bytes
            if (i >= self._most_files or total > self._most_bytes) and file.name != newest:
                try:
                    (self.path / file.name).unlink(missing_ok=True)
                except OSError as error:
                    raise unreachable(self.path / file.name, error) from error


def _described(path: Path, match: re.Match[str]) -> IncidentFile:
    digits, words = match.groups()
    date, clock = digits[:8], digits[9:]
    saved_at = (
        f"{date[:4]}-{date[4:6]}-{date[6:]}T{clock[:2]}:{clock[2:4]}:{clock[4:6]}.{clock[6:9]}Z"
    )
    return IncidentFile(path.name, saved_at, words.replace("-", " "), path.stat().st_size)


def packed(document: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return the content of a file: an .npz archive of a JSON document and arrays.

    Raises
    ------
    InputError
        If it would be too large to be read again.
    """
    text = json.dumps(document, separators=(",", ":")).encode()
    total = len(text) + sum(array.nbytes for array in arrays.values())
    if len(text) > _MOST_DOCUMENT_BYTES or total > MOST_BYTES:
        raise InputError(
            f"The incident is larger than {MOST_BYTES} bytes. Set incident_seconds to less."
        )
    buffer = io.BytesIO()
    members: dict[str, Any] = {"document": np.frombuffer(text, np.uint8), **arrays}
    np.savez_compressed(buffer, **members)
    return buffer.getvalue()


def load_incident(path: str | os.PathLike[str]) -> tuple[dict[str, Any], Arrays]:
    """Read a file that may come from a stranger; nothing in it is executed.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    dict, dict of ndarray
        The document and its arrays, for `firstfix.localizer.incident_document.from_document`.

    Raises
    ------
    InputError
        If it is no incident, damaged, or larger than 256 MiB unpacked.
    """
    file = Path(path)
    check_is_file(file, "a file of an incident")
    try:
        arrays = _unpacked(file)
        document = json.loads(arrays.pop("document").tobytes())
    except InputError:
        raise
    except OSError as error:
        raise unreachable(file, error) from error
    except Exception as error:
        raise _damaged(file) from error
    if not isinstance(document, dict):
        raise _damaged(file)
    return document, arrays


def _unpacked(path: Path) -> Arrays:
    """Unpack the arrays, after a check of the sizes that the archive states."""
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size > MOST_BYTES:
            raise _damaged(path)
        with zipfile.ZipFile(file) as archive:
            sizes = {info.filename: info.file_size for info in archive.infolist()}
            found = [name for name in _TYPES if f"{name}.npy" in sizes]
            is_large = sum(sizes[f"{name}.npy"] for name in found) > MOST_BYTES
            if is_large or sizes.get("document.npy", 0) > _MOST_DOCUMENT_BYTES + 1000:
                raise InputError(
                    f"{show(str(path))} is too large, unpacked. firstfix saves no such incident: "
                    "do not trust the file."
                )
            arrays = {name: _array(archive, name, sizes[f"{name}.npy"]) for name in found}
    if not {"document", "arrays", "start_arrays"} <= set(arrays):
        raise _damaged(path)
    return arrays


def _array(archive: zipfile.ZipFile, name: str, size: int) -> NDArray[Any]:
    """Read one array; its header must agree with its size, so that nothing huge is allocated."""
    with archive.open(f"{name}.npy") as member:
        version = np.lib.format.read_magic(member)
        if version != (1, 0):
            raise ValueError("a header of another version")
        shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(member)
        content = member.read(size)
    if dtype != np.dtype(_TYPES[name]) or len(shape) not in (1, 2):
        raise ValueError("an array of another type")
    return np.frombuffer(content, dtype).reshape(shape, order="F" if is_fortran else "C")


def _damaged(path: Path) -> InputError:
    return InputError(
        f"{show(str(path))} is no incident, or it is damaged. Copy the file again; firstfix saves "
        "incidents as .npz."
    )
