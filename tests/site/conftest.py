"""A small site of drawn maps."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from firstfix.site.site import Site

sys.path.insert(0, str(Path(__file__).parents[1] / "robots"))  # site_lab

from site_lab import save_rooms


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_rooms(tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="session")
def site(folder: Path) -> Site:
    return Site.load(folder)
