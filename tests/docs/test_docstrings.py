"""Every public name has a docstring with an example that runs.

The examples use the map ``grid`` and the scan ``scan`` that the first block of
docs/reference/python.md draws.
"""

import doctest
import inspect
import re
from pathlib import Path
from typing import Any

import pytest

import firstfix as ff

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs" / "reference" / "python.md"
SLOW = {"precompile", "simulate_drive"}


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """Give the names that the first block of the page defines."""
    text = REFERENCE.read_text(encoding="utf-8")
    block = re.search(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert block is not None
    namespace: dict[str, Any] = {}
    exec(block[1], namespace)  # noqa: S102 - our own page
    assert {"ff", "np", "grid", "scan"} <= set(namespace)
    return namespace


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in ff.__all__],
)
def test_the_examples_of_a_public_name_run(
    name: str, names: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    thing = getattr(ff, name)
    tests = doctest.DocTestFinder().find(thing, name, globs=names)
    assert any(test.examples for test in tests if test.name == name), f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    report: list[str] = []
    for test in tests:
        runner.run(test, out=report.append)
    assert runner.failures == 0, "".join(report)


@pytest.mark.parametrize("name", ff.__all__)
def test_a_docstring_begins_with_one_sentence_and_describes_all_parameters(name: str) -> None:
    thing = getattr(ff, name)
    text = inspect.getdoc(thing)
    assert text is not None
    assert text.split("\n\n")[0].count("\n") <= 1
    assert text.split("\n\n")[0].rstrip("`").endswith(".")
    described = re.findall(r"^(\w+(?:, \w+)*) : ", text, re.MULTILINE)
    if described:
        parameters = {part for line in described for part in line.split(", ")}
        assert set(inspect.signature(thing).parameters) <= parameters, name
