"""Options of ``firstfix bench`` that do not fit: refused in one sentence, before any work."""

from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["somewhere", "--track", "--wrong-map"], "--wrong-map"),
        (["somewhere", "--track", "--method", "paper"], "--method"),
        (["somewhere", "--track", "--limit", "3"], "--limit"),
        (["somewhere", "--track", "--report", "out"], "--report"),
        (["somewhere", "--seed", "1"], "--track"),
        (["somewhere", "--params", "amcl.yaml"], "--track"),
        (["--kidnap", "--wrong-map"], "--wrong-map"),
        (["--kidnap", "--method", "paper"], "--method"),
        (["--kidnap", "--limit", "3"], "--limit"),
        (["--kidnap", "--params", "amcl.yaml"], "--params"),
        (["--kidnap", "--worlds", "office,moon"], "'moon'"),
        (["--kidnap", "--worlds", ""], "''"),
        (["--kidnap", "--cases", "nowhere"], "nowhere"),
        (["--kidnap", "--worlds", "house", "--out", "file/b.json"], "file/b.json"),
        (["--kidnap", "--worlds", "house", "--report", "file/out"], "file/out"),
        (["--scenarios", "3"], "--kidnap"),
        (["--worlds", "office"], "--kidnap"),
        (["--track", "--kidnap"], "--kidnap"),
        (["--track", "--scenarios", "3"], "--scenarios"),
        (["--track"], "CASES"),
        ([], "CASES"),
        (["--starts"], "CASES"),
        (["somewhere", "--starts", "--track"], "--track"),
        (["somewhere", "--starts", "--limit", "2"], "--limit"),
        (["somewhere", "--sensor", "60"], "--sensor FOV,RANGE"),
        (["--kidnap", "--sensor", "wide"], "'wide'"),
        (["--site"], "--floors"),
        (["somewhere", "--site"], "CASES"),
        (["--site", "--floors", "1-2", "--seed", "3"], "--seed"),
        (["--rides", "5", "--floors", "1-2"], "--floors"),
        (["--rides", "5", "--site"], "--site"),
        (["--kidnap", "--maps", "somewhere"], "--maps"),
        (["--suite", "paper", "--worlds", "moon"], "'moon'"),
        (["--suite", "paper", "--wrong-map"], "--wrong-map"),
        (["--suite", "paper", "--limit", "3"], "--limit"),
        (["--suite", "paper", "--kidnap"], "--kidnap"),
        (["--suite", "paper", "--worlds", "house", "--out", "file/b.json"], "file/b.json"),
        (["--suite", "paper", "--worlds", "house", "--report", "file/out"], "file/out"),
        (["somewhere", "--suite", "paper"], "CASES"),
        (["somewhere", "--suite", "scaling"], "CASES"),
        (["--suite", "scaling", "--jobs", "2"], "--jobs"),
        (["--suite", "scaling", "--runs", "2"], "--runs"),
        (["--suite", "ablation"], "CASES"),
        (["--suite", "ablation", "--seed", "2"], "--seed"),
        (["--suite", "ablation", "nowhere"], "nowhere"),
        (["--suite", "calibration"], "CASES"),
        (["--suite", "calibration", "--floors", "7-8"], "cases of 3 buildings"),
        (["--suite", "calibration", "--floors", "7", "--method", "paper"], "--method"),
        (["--runs", "3"], "--runs"),
        (["--track", "--runs", "3"], "--runs"),
        (["--kidnap", "--suite", "paper"], "--kidnap"),
    ],
)
def test_options_that_do_not_fit_are_refused(
    cli, tmp_path: Path, options: list[str], word: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    cli("bench", *options).assert_refused(word)
