#!/usr/bin/env python3
"""Looks through a wheel, and completes and checks its bill of materials.

Arguments: the wheel, and what cyclonedx-py wrote. The finished bill is written next to the wheel.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import zipfile
from pathlib import Path

LOCK = Path(__file__).resolve().parents[1] / "requirements.lock"
WANTED = (
    "firstfix/py.typed",
    "firstfix/web/static/index.html",
    "/entry_points.txt",
    "/licenses/LICENSE",
    "/share/firstfix/package.xml",
    "/lib/firstfix/firstfix_node",
)


def main(wheel: Path, sbom: Path) -> None:
    """Check both, and write the bill of materials."""
    names = zipfile.ZipFile(wheel).namelist()
    missing = [end for end in WANTED if not any(name.endswith(end) for name in names)]
    junk = [name for name in names if re.search(r"__pycache__|\.(nbi|nbc|pyc)$", name)]
    strangers = [name for name in names if not name.startswith("firstfix")]
    _expect_none(missing=missing, junk=junk, strangers=strangers)
    print(f"{wheel}: {len(names)} files")

    bill = json.loads(sbom.read_text(encoding="utf-8"))
    parts = bill["components"]
    unlicensed = [part["name"] for part in parts if not part.get("licenses")]
    pinned = set(re.findall(r"^([\w.-]+)==(\S+)", LOCK.read_text(encoding="utf-8"), re.MULTILINE))
    unpinned = [p["purl"] for p in parts if (_normal(p["name"]), p["version"]) not in pinned]
    _expect_none(unlicensed=unlicensed, unpinned=unpinned)

    package, version = wheel.name.split("-")[:2]
    # The version is dynamic, so cyclonedx-py cannot read it from pyproject.toml.
    bill["metadata"]["component"] |= {
        "version": version,
        "purl": f"pkg:pypi/{package}@{version}",
        "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(wheel.read_bytes()).hexdigest()}],
    }
    path = wheel.with_name(f"{package}-{version}.cdx.json")
    path.write_text(json.dumps(bill, indent=1) + "\n", encoding="utf-8")
    print(f"{path}: {len(parts)} components")


def _expect_none(**found: list[str]) -> None:
    if any(found.values()):
        sys.exit(f"expected none of these: {found}")


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
