"""Coverage-guided fuzzing of one reader, by atheris (libFuzzer).

``python fuzz/run.py carmen -max_total_time=600``: an input that breaks the reader is
written to the current folder as ``crash-...``. After the fix, move it to ``fuzz/inputs/<target>/``,
where a test reads it again.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["firstfix"]):
    import firstfix.core.grid
    import firstfix.core.recording
# Without the layers of kernels, which do not compile when instrumented.
import firstfix.global_localization.scan_matcher
import firstfix.localizer.localizer  # noqa: F401

with atheris.instrument_imports(include=["firstfix", "rosbags"]):
    from targets import TARGETS, seeds, try_one


def main() -> None:
    """Fuzz the target of the first argument; the other arguments are libFuzzer's."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"expected one of {', '.join(TARGETS)}")
    name = sys.argv.pop(1)
    corpus = Path(tempfile.mkdtemp(prefix=f"firstfix-corpus-{name}-"))
    work = Path(tempfile.mkdtemp(prefix="firstfix-seeds-"))
    for i, data in enumerate(seeds(name, work)):
        (corpus / f"seed{i}").write_bytes(data)
        try_one(name, data)  # compiles kernels before a clock runs
    kept = Path(__file__).parent / "inputs" / name
    folders = [str(corpus), *([str(kept)] if kept.is_dir() else [])]
    limits = ["-timeout=20", "-rss_limit_mb=3000", "-max_len=20000"]
    atheris.Setup([*sys.argv, *limits, *folders], lambda data: try_one(name, data))
    atheris.Fuzz()


if __name__ == "__main__":
    main()
