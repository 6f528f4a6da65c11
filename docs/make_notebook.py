"""Runs examples/firstfix.ipynb and keeps its outputs: ``python docs/make_notebook.py``."""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[1] / "examples" / "firstfix.ipynb"


def read() -> nbformat.NotebookNode:
    """Return the notebook with its kept outputs."""
    return nbformat.read(NOTEBOOK, as_version=4)


def executed() -> nbformat.NotebookNode:
    """Return the notebook with outputs of now; an error of a cell is raised."""
    book = read()
    NotebookClient(book, timeout=300, resources={"metadata": {"path": NOTEBOOK.parent}}).execute()
    for cell in (cell for cell in book.cells if cell.cell_type == "code"):
        cell.metadata.pop("execution", None)  # times
        # Notes on stderr depend on the machine, such as that kernels are compiled.
        cell.outputs = [out for out in cell.outputs if out.get("name") != "stderr"]
        for output in cell.outputs:
            if "image/png" in output.get("data", {}):
                output.data.pop("text/html", None)  # holds the same picture
    return book


if __name__ == "__main__":
    nbformat.write(executed(), NOTEBOOK)
