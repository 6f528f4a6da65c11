"""Progress without a terminal."""

from __future__ import annotations

import pytest

from firstfix.cli.progress import progress, progress_of_start


def test_without_a_terminal_long_work_prints_a_line_now_and_then(
    capsys: pytest.CaptureFixture[str],
) -> None:
    times = iter([0.0, 1.0, 11.0, 11.0, 12.0])
    with progress(3, "preparing maps", lambda: next(times)) as done:
        for name in ("ground", "first", "second"):
            done(name)
    assert capsys.readouterr().err == "preparing maps: 2 of 3 (first)\n"


def test_the_progress_of_a_start_ends_with_its_last_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress_of_start(2, "preparing maps") as done:
        done("ground")
        done("first")
        shown = capsys.readouterr().err
        done("a map that is prepared again")
    assert "preparing maps" in shown
    assert capsys.readouterr().err == ""
