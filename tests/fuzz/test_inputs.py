"""Inputs that broke a reader once, and valid ones, raise only errors of firstfix."""

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


def test_inputs_that_broke_a_reader_once_are_refused():
    for path in FOUND:
        targets.try_one(path.parent.name, path.read_bytes())


@pytest.mark.parametrize("name", targets.TARGETS)
def test_seeds_are_valid_inputs(name, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    found = list(targets.seeds(name, tmp_path))
    assert found
    for i, data in enumerate(found):
        folder = work / f"{i}"
        folder.mkdir()
        targets.TARGETS[name](data, folder)
