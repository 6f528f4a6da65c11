"""``firstfix bench --site`` and ``--rides``: options; the work itself is tested in lab."""

from pathlib import Path

import pytest


@pytest.mark.parametrize("measure", [["--rides", "2"], ["--site", "--floors", "1"]])
def test_a_folder_for_maps_that_is_a_file_is_one_sentence(
    cli, tmp_path: Path, measure: list[str]
) -> None:
    (tmp_path / "file").touch()
    ended = cli("bench", *measure, "--maps", tmp_path / "file")
    assert ended.status == 2
    assert ended.err.startswith("firstfix: ")
    assert ended.err.count("\n") == 1
