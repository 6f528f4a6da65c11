"""The notebook runs, and its kept outputs are those of today."""

import importlib.util
import json
from pathlib import Path
from typing import Any

import pytest
from required import missing

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "docs" / "make_notebook.py"


def printed(book: Any) -> list[list[str]]:
    """Return what each cell printed, and the text of what it displayed."""
    return [
        [out.get("text") or out["data"]["text/plain"] for out in cell["outputs"]]
        for cell in book["cells"]
        if cell["cell_type"] == "code"
    ]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # of the tools of Jupyter
def test_the_notebook_runs_and_prints_what_it_shows() -> None:
    for needed in ("nbclient", "ipykernel"):
        if importlib.util.find_spec(needed) is None:
            missing("notebook", f"no {needed}: pip install 'firstfix[dev]'")
    spec = importlib.util.spec_from_file_location("make_notebook", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert printed(script.executed()) == printed(script.read()), "run: python docs/make_notebook.py"


def test_the_notebook_is_small_and_shows_pictures() -> None:
    path = ROOT / "examples" / "firstfix.ipynb"
    assert path.stat().st_size < 200_000
    outputs = [
        out for cell in json.loads(path.read_text())["cells"] for out in cell.get("outputs", [])
    ]
    assert sum("image/png" in out.get("data", {}) for out in outputs) >= 3
