"""Commands, options, make targets and scripts that the pages name exist."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from firstfix.cli.app import app

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
# An indented line of code, or text between backticks.
CODE = re.compile(r"^ {4,}(\S.*)$|`([^`]+)`", re.MULTILINE)
COMMAND = re.compile(r"^(?:\S*/)?firstfix ([a-z].*)")
TARGET = re.compile(r"(?<!case )\bmake ([a-z-]+)")
SCRIPT = re.compile(r"\b(?:benchmarks|fuzz|docs|\.ci)/[\w/-]+\.py\b")


def code_of(page: Path) -> list[str]:
    """Return all lines of code of a page."""
    text = re.sub(
        r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE
    )
    return [re.split(r" +# ", line or quoted)[0] for line, quoted in CODE.findall(text)]


def check_command(line: str) -> None:
    """Check that a command and all its options exist."""
    command = get_command(app)
    words = shlex.split(line.replace("...", ""))
    while words and hasattr(command, "commands"):
        name = words.pop(0).rstrip(",;")
        assert name in command.commands, f"firstfix {line}: no command {name}"
        command = command.commands[name]
    options = {option for given in command.params for option in (*given.opts, "--help")}
    for word in words[: words.index("--")] if "--" in words else words:
        if re.match(r"--?[a-z]", word):
            assert word.split("=")[0] in options, f"firstfix {line}: no option {word}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_exist(page: Path) -> None:
    for code in code_of(page):
        for found in COMMAND.findall(code):
            check_command(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_targets_and_scripts_exist(page: Path) -> None:
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
    for code in code_of(page):
        assert set(TARGET.findall(code)) <= set(targets), code
        for script in SCRIPT.findall(code):
            assert (ROOT / script).exists(), f"{page.name} names {script}"


@pytest.mark.parametrize(
    "line", ["lokate map.yaml", "locate map.yaml scan.npz --plott x.png", "map chek map.yaml"]
)
def test_an_unknown_command_or_option_fails(line: str) -> None:
    with pytest.raises(AssertionError, match=r"no (command|option)"):
        check_command(line)
