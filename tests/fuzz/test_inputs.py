"""Inputs that once broke a reader, and good ones: nothing but errors of ours may come."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[2] / "fuzz"

spec = importlib.util.spec_from_file_location("fuzz_targets", FUZZ / "targets.py")
assert spec is not None
assert spec.loader is not None
targets = importlib.util.module_from_spec(spec)
spec.loader.exec_module(targets)

FOUND = sorted(path for path in (FUZZ / "inputs").glob("*/*") if path.is_file())


def test_what_once_broke_a_reader_does_not_any_more():
    for path in FOUND:
        targets.try_one(path.parent.name, path.read_bytes())


@pytest.mark.parametrize("name", targets.TARGETS)
def test_seeds_are_good_inputs(name, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    found = list(targets.seeds(name, tmp_path))
    assert found
    for i, data in enumerate(found):
        folder = work / f"{i}"
        folder.mkdir()
        targets.TARGETS[name](data, folder)
