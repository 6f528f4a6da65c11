"""What a benchmark ran on."""

import platform
from pathlib import Path

import pytest

from firstfix.lab.experiments.machine import commit_of, machine_text, this_machine

COMMIT = "0123456789abcdef0123456789abcdef01234567"


def test_the_machine_is_described_but_not_named() -> None:
    machine = this_machine()
    text = machine_text(machine)
    assert machine["cores"] >= 1
    assert machine["python"] == platform.python_version()
    assert f"numpy {machine['numpy']}" in text
    assert platform.node() not in machine.values()


def test_unknown_facts_are_none() -> None:
    text = machine_text(this_machine() | {"memory_gb": None, "commit": None})
    assert "memory not known" in text
    assert text.endswith("commit not known.")


@pytest.mark.parametrize(
    "files",
    [
        {"HEAD": COMMIT},
        {"HEAD": "ref: refs/heads/main", "refs/heads/main": f"{COMMIT}\n"},
        {
            "HEAD": "ref: refs/heads/main\n",
            "packed-refs": f"# pack-refs with: peeled\n{COMMIT} refs/heads/main\n^{COMMIT}\n",
        },
    ],
)
def test_the_commit_of_a_checkout_is_found(tmp_path: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = tmp_path / ".git" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    inside = tmp_path / "src" / "module.py"
    assert commit_of(inside) == COMMIT[:10]


@pytest.mark.parametrize("head", ["", "ref: refs/heads/gone", "nonsense", "ref: ../../etc"])
def test_a_checkout_without_a_commit_has_none(tmp_path: Path, head: str) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git" / "HEAD").write_text(head)
    assert commit_of(tmp_path / "module.py") is None


def test_outside_of_a_checkout_there_is_no_commit() -> None:
    assert commit_of(Path("/nowhere/module.py")) is None
