"""What the page on releases states about signatures, licences and the lock holds."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import firstfix

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "release.md").read_text(encoding="utf-8")


def bash(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["/bin/bash", "-c", line], cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.mark.skipif(
    shutil.which("ssh-keygen") is None, reason="without ssh-keygen (openssh-client)"
)
def test_a_signed_release_is_verified_and_a_changed_one_is_not(tmp_path: Path) -> None:
    """`make sign` signs, and the commands of the page verify."""
    dist = tmp_path / "dist"
    dist.mkdir()
    (dist / "firstfix.whl").write_bytes(b"a wheel")
    assert bash("sha256sum firstfix.whl > SHA256SUMS", dist).returncode == 0
    assert bash("ssh-keygen -q -t ed25519 -N '' -f key", tmp_path).returncode == 0
    (rule,) = re.findall(r"^sign:\n\t(.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert bash(rule.replace("$(KEY)", "key"), tmp_path).returncode == 0
    key = (tmp_path / "key.pub").read_text()
    (dist / "allowed_signers").write_text(f'NAME namespaces="firstfix-release,git" {key}')
    commands = re.findall(r"^    ((?:ssh-keygen|sha256sum) .*)$", PAGE, re.MULTILINE)
    assert [bash(command, dist).returncode for command in commands] == [0, 0]
    (dist / "firstfix.whl").write_bytes(b"another wheel")
    assert [bash(command, dist).returncode for command in commands] == [0, 1]
    with (dist / "SHA256SUMS").open("a") as sums:
        sums.write("0  more\n")
    assert bash(commands[0], dist).returncode != 0


def test_licence_texts_are_the_same() -> None:
    assert (ROOT / "LICENSE").read_text() == (ROOT / "LICENSES" / "Apache-2.0.txt").read_text()


def test_the_lock_pins_every_dependency_with_hashes() -> None:
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    pins = re.findall(r"^([\w.-]+)==.*\\\n +--hash=sha256:[0-9a-f]{64}", lock, re.MULTILINE)
    assert len(pins) == len(re.findall(r"^[\w.-]+==", lock, re.MULTILINE))
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (block,) = re.findall(r"^dependencies = \[\n(.*?)^\]", project, re.DOTALL | re.MULTILINE)
    assert set(re.findall(r'^  "([\w.-]+)', block, re.MULTILINE)) <= set(pins)


def test_versions_agree() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [firstfix.__version__]
    package = (ROOT / "ros" / "package.xml").read_text(encoding="utf-8")
    assert f"<version>{firstfix.__version__}</version>" in package
