"""What several test rooms share."""

import os
from collections.abc import Iterator
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


@pytest.fixture(scope="session", autouse=True)
def cache_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Keep prepared maps of tests, and of the processes they start, out of the user's cache."""
    folder = tmp_path_factory.mktemp("firstfix-cache")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("FIRSTFIX_CACHE_DIR", str(folder))
        yield folder
