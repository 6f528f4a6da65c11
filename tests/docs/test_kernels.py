"""The table of kernels: each has a line, or is a part of one."""

import re
from pathlib import Path

import pytest

from firstfix.fields.kernel_cache import PACKAGE, kernel_sources

LINES = "".join(
    path.read_text(encoding="utf-8")
    for path in sorted((Path(__file__).parents[2] / "benchmarks" / "kernels").glob("of_*.py"))
)
KERNELS = [
    (path.relative_to(PACKAGE).as_posix(), name)
    for path in kernel_sources()
    for name in re.findall(r"^@kernel\ndef (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
]


@pytest.mark.parametrize(("module", "name"), KERNELS)
def test_every_kernel_is_measured(module: str, name: str) -> None:
    assert re.search(rf"\w\.{name}\b", LINES), f"benchmarks/kernels has no line for {name}"


def test_kernels_are_found() -> None:
    assert len(KERNELS) > 50
