"""The page on ROS names topics, parameters, files and sentences that exist."""

import re
from pathlib import Path

import pytest
import yaml

from firstfix.ros.arguments import names_from, settings_from
from firstfix.ros.node_config import Mode
from firstfix.ros.parameters import configured, flattened, parameters

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "ros.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\|(.*)\|$", re.MULTILINE)


def table(title: str) -> list[list[str]]:
    """Return the cells of the first table of a chapter, without its head."""
    chapter = re.split(rf"^## {re.escape(title)}$", PAGE, flags=re.MULTILINE)[1]
    rows = [
        row.split("|") for row in ROW.findall(re.split(r"^## ", chapter, flags=re.MULTILINE)[0])
    ]
    width = len(rows[0])
    return [[cell.strip() for cell in row] for row in rows[2:] if len(row) == width]


def test_defaults_are_those_of_the_node() -> None:
    known = {parameter.name: parameter.default for parameter in parameters()}
    for name, default, _ in table("Parameters"):
        value = known[name.strip("`")]
        text = str(value).lower() if isinstance(value, bool) else str(value)
        assert default.strip("`") == (text or "empty")


def test_sentences_are_those_of_the_node() -> None:
    code = "".join(path.read_text() for path in (ROOT / "src" / "firstfix").rglob("*.py"))
    code = re.sub(r'"\s*f?"', "", code)
    for sentence, _ in table("Warnings of the node"):
        words = sentence.strip("`").split("; ")
        for part in words:
            # What stands at the ends is put in by the code.
            fixed = re.sub(r"^expected | (scan|map|events/cliff|odometry)$", "", part)
            assert fixed in code, f"{sentence} is in no source"


def test_parameters_of_the_example_are_right() -> None:
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    values = flattened(yaml.safe_load(text)["firstfix"]["ros__parameters"])
    assert configured(values).mode is Mode.FULL


def test_the_launch_file_of_the_example_is_installed() -> None:
    (text,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    compile(text, "bringup.launch.py", "exec")
    (name,) = re.findall(r'"([\w.]+launch\.py)"', text)
    assert (ROOT / "ros" / "launch" / name).is_file()


def test_the_recovery_on_the_page_is_the_installed_one() -> None:
    (text,) = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
    installed = (ROOT / "ros" / "behavior_trees" / "relocalize.xml").read_text()
    assert "".join(text.split()) in "".join(installed.split())


def test_keys_of_the_status_are_those_of_the_node() -> None:
    code = (ROOT / "src" / "firstfix" / "ros" / "output_publisher.py").read_text()
    chapter = PAGE.split("### Keys of `localization_status`")[1].split("\n## ")[0]
    keys = re.findall(r"`(\w+)`", " ".join(re.findall(r"^\|([^|]*)\|", chapter, re.MULTILINE)))
    assert len(keys) == 10
    for key in keys:
        assert f'"{key}"' in code


@pytest.mark.parametrize(
    "line", re.findall(r"^    \S*firstfix dds --ros-args (.*)$", PAGE, re.MULTILINE)
)
def test_arguments_of_the_example_are_right(line: str) -> None:
    words = line.split()
    pairs = list(zip(words[::2], words[1::2], strict=True))
    rules = [value for flag, value in pairs if flag == "-r"]
    given = [value for flag, value in pairs if flag == "-p"]
    names = names_from(rules, "firstfix", "/")
    config = settings_from(node=names.node, amcl_file=None, files=[], assignments=given, options={})
    assert config.mode is Mode.FULL
    assert names.resolve("scan") == "/base_scan"


def test_what_is_started_is_in_the_package() -> None:
    for name in (
        "bootstrap.launch.py",
        "simulation.launch.py",
        "firstfix_node",
        "config/firstfix.yaml",
    ):
        assert name in PAGE
        assert list((ROOT / "ros").rglob(Path(name).name))
