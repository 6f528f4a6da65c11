"""``firstfix bench --site`` and ``--rides``: options; the work itself is tested in lab."""

from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--site"], "--floors"),
        (["somewhere", "--site"], "CASES"),
        (["--site", "--floors", "1-2", "--seed", "3"], "--seed"),
        (["--rides", "5", "--floors", "1-2"], "--floors"),
        (["--rides", "5", "--site"], "--site"),
        (["--kidnap", "--maps", "somewhere"], "--maps"),
    ],
)
def test_options_that_do_not_fit_are_refused(cli, options: list[str], word: str) -> None:
    ended = cli("bench", *options)
    assert (ended.status, ended.out) == (2, "")
    assert ended.err.startswith("firstfix: expected ")
    assert ended.err.count("\n") == 1
    assert word in ended.err


@pytest.mark.parametrize("measure", [["--rides", "2"], ["--site", "--floors", "1"]])
def test_a_folder_for_maps_that_is_a_file_is_one_sentence(
    cli, tmp_path: Path, measure: list[str]
) -> None:
    (tmp_path / "file").touch()
    ended = cli("bench", *measure, "--maps", tmp_path / "file")
    assert ended.status == 2
    assert ended.err.startswith("firstfix: ")
    assert ended.err.count("\n") == 1
