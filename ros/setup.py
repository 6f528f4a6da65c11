"""The package in a workspace of ROS 2, for ``colcon build``. pip uses pyproject.toml instead."""

from __future__ import annotations

import re
from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parent / "src"
# Folders of the installed package; from pyproject.toml, tests compare.
FOLDERS = {
    "share/ament_index/resource_index/packages": ["resource/firstfix"],
    "share/firstfix": ["package.xml"],
    "share/firstfix/behavior_trees": ["behavior_trees/*.xml"],
    "share/firstfix/config": ["config/*.yaml"],
    "share/firstfix/foxglove": ["foxglove/*.json"],
    "share/firstfix/launch": ["launch/*.launch.py", "ros1/*.launch"],
    "share/firstfix/ros1": ["ros1/firstfix_ros1"],
    "share/firstfix/rviz": ["rviz/*.rviz"],
    "lib/firstfix": ["firstfix_node"],
}


def data_files() -> list[tuple[str, list[str]]]:
    """Return what is installed beside the Python package, relative to this folder."""
    return [
        (
            folder,
            [str(path.relative_to(HERE)) for glob in globs for path in sorted(HERE.glob(glob))],
        )
        for folder, globs in FOLDERS.items()
    ]


def version() -> str:
    """Return the version of the Python package."""
    text = (SOURCE / "firstfix" / "__init__.py").read_text(encoding="utf-8")
    return re.findall(r'^__version__ = "(.+)"$', text, re.MULTILINE)[0]


if __name__ == "__main__":
    setup(
        name="firstfix",
        version=version(),
        package_dir={"": "../src"},
        packages=find_packages(str(SOURCE)),
        package_data={
            "firstfix": ["py.typed"],
            "firstfix.fleet": ["static/*"],
            "firstfix.web": ["static/*", "static/**/*"],
        },
        data_files=data_files(),
        zip_safe=False,
        entry_points={"console_scripts": ["firstfix = firstfix.cli.app:main"]},
    )
