"""What several test rooms share."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """Give the folder with recorded data that no checkout contains; skip where it is absent."""
    beside = Path(__file__).resolve().parents[1].parent / "shared"
    folder = Path(os.environ.get("FIRSTFIX_SHARED", beside))
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: set FIRSTFIX_SHARED to the one with the recorded data")
    return folder
