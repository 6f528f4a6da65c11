"""Incidents in files: bounded folders, and files of strangers."""

from __future__ import annotations

import io
import zipfile
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.io import incident_files
from firstfix.io.incident_files import IncidentFolder, incident_folder, load_incident, packed

NOW = datetime(2026, 11, 30, 10, 15, 2, 123456, tzinfo=timezone.utc)
ARRAYS = {
    "arrays": np.arange(9, dtype=np.uint8),
    "start_arrays": np.zeros(0, np.uint8),
    "cells": np.full((3, 4), -1, np.int8),
    "unseen": np.eye(3, 4, dtype=np.bool_),
}


def test_a_file_comes_back_as_it_was(tmp_path):
    path = tmp_path / "incident.npz"
    path.write_bytes(packed({"format": "x", "stamp": 0.1}, ARRAYS))
    document, arrays = load_incident(path)
    assert document == {"format": "x", "stamp": 0.1}
    assert set(arrays) == set(ARRAYS)
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert np.array_equal(arrays[name], array)


def test_the_newest_files_stay(tmp_path):
    folder = IncidentFolder(tmp_path / "new" / "folder", most_files=3)
    (tmp_path / "new").mkdir()
    names = [folder.save(b"x" * i, "lost pose", NOW + timedelta(seconds=i)) for i in range(5)]
    assert names[0] == "incident-20261130T101502123Z-lost-pose.npz"
    assert [file.name for file in folder.files()] == names[:1:-1]
    newest = folder.files()[0]
    assert (newest.saved_at, newest.cause) == ("2026-11-30T10:15:06.123Z", "lost pose")
    assert newest.bytes == 4


def test_all_files_together_are_bounded_and_others_are_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_bytes(b"n" * 500)
    folder = IncidentFolder(tmp_path, most_bytes=250)
    for i in range(4):
        folder.save(b"x" * 100, "revoked pose", NOW + timedelta(seconds=i))
    assert len(folder.files()) == 2
    # The newest one stays, however large.
    folder.save(b"x" * 300, "revoked pose", NOW + timedelta(seconds=9))
    assert [file.bytes for file in folder.files()] == [300]
    assert (tmp_path / "notes.txt").exists()


def test_only_incidents_of_the_folder_are_read(tmp_path):
    (tmp_path / "secret.npz").write_bytes(b"secret")
    folder = IncidentFolder(tmp_path / "incidents")
    assert folder.files() == []
    name = folder.save(b"abc", "requested", NOW)
    (folder.path / name.replace("02123", "03123")).symlink_to(tmp_path / "secret.npz")
    assert folder.read(name) == b"abc"
    for other in ("../secret.npz", name.replace("02123", "03123"), "", "/etc/passwd"):
        assert folder.read(other) is None


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    folder = IncidentFolder(tmp_path / "file" / "incidents")
    with pytest.raises(InputError, match="access to"):
        folder.save(b"", "requested", NOW)
    assert folder.files() == []


def test_the_folder_is_a_parameter_or_a_variable_or_that_of_the_user(monkeypatch):
    assert incident_folder("here") == Path("here")
    monkeypatch.setenv("FIRSTFIX_INCIDENT_DIR", "/there")
    assert incident_folder() == Path("/there")
    monkeypatch.delenv("FIRSTFIX_INCIDENT_DIR")
    monkeypatch.setenv("XDG_STATE_HOME", "/state")
    assert incident_folder() == Path("/state/firstfix/incidents")


# ---- files of strangers


def archive(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return path


def npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=True)
    return buffer.getvalue()


def good() -> dict[str, bytes]:
    members = {name: npy(array) for name, array in ARRAYS.items()}
    return members | {"document": npy(np.frombuffer(b"{}", np.uint8))}


class _Evil:
    def __reduce__(self):
        return Path.touch, (Path("pwned"),)


HOSTILE = {
    "a pickle": {"arrays": npy(np.array([_Evil()], object))},
    "a header that promises more": {
        "arrays": npy(np.zeros(9, np.uint8)).replace(b"(9,), ", b"(9" + b"0" * 11 + b",), ")
    },
    "floats": {"cells": npy(np.zeros((3, 4)))},
    "four dimensions": {"cells": npy(np.zeros((1, 1, 2, 2), np.int8))},
    "no JSON": {"document": npy(np.frombuffer(b"{", np.uint8))},
    "deep JSON": {"document": npy(np.frombuffer(b"[" * 100_000, np.uint8))},
    "a list": {"document": npy(np.frombuffer(b"[]", np.uint8))},
    "bytes that are no text": {"document": npy(np.full(9, 255, np.uint8))},
    "no array": {"arrays": b"\x93NUMPY"},
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_file_is_one_sentence(tmp_path, monkeypatch, what):
    monkeypatch.chdir(tmp_path)
    path = archive(tmp_path / "evil.npz", **(good() | HOSTILE[what]))
    with pytest.raises(InputError, match="is no incident, or it is damaged"):
        load_incident(path)
    assert not (tmp_path / "pwned").exists()


def test_a_zip_bomb_is_not_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(incident_files, "MOST_BYTES", 10_000)
    path = archive(tmp_path / "bomb.npz", **(good() | {"arrays": npy(np.zeros(20_000, np.uint8))}))
    assert path.stat().st_size < 3000
    with pytest.raises(InputError, match="too large"):
        load_incident(path)


def test_a_missing_array_and_other_files_are_refused(tmp_path):
    members = good()
    del members["start_arrays"]
    with pytest.raises(InputError, match="damaged"):
        load_incident(archive(tmp_path / "less.npz", **members))
    (tmp_path / "text").write_text("hello")
    with pytest.raises(InputError, match="damaged"):
        load_incident(tmp_path / "text")
    with pytest.raises(InputError, match="no file"):
        load_incident(tmp_path)


def test_an_incident_that_could_not_be_read_again_is_not_written(monkeypatch):
    monkeypatch.setattr(incident_files, "MOST_BYTES", 30)
    with pytest.raises(InputError, match="incident_seconds"):
        packed({"text": "long" * 10}, ARRAYS)
