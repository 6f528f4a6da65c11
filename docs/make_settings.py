"""Writes docs/reference/settings.md, and the tables of docs/ros.md, from the code.

``python docs/make_settings.py``
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from firstfix.ros.channels import PARTICLES, published_topics, subscriptions
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.parameters import Parameter, parameters
from firstfix.ros.services import WAIT, ros1_services, ros2_services

PAGE = Path(__file__).parent / "reference" / "settings.md"
ROS_PAGE = Path(__file__).parent / "ros.md"
MARK = "<!-- topics, by docs/make_settings.py -->"
SERVICES_MARK = "<!-- services, by docs/make_settings.py -->"
HEAD = """# Settings

Of the nodes (`firstfix ros1`, `ros2`, `dds`), as private parameters; and of `firstfix track
--params`, as far as they are those of AMCL. Written by `docs/make_settings.py` from the dataclasses
that check them.

| name | default | range | meaning |
|---|---|---|---|
"""


def page() -> str:
    """Return the whole page."""
    return HEAD + "".join(_row(parameter) for parameter in parameters())


def topics() -> str:
    """Return the table of topics between its marks in docs/ros.md."""
    full, bootstrap = NodeConfig(mode=Mode.FULL), NodeConfig()
    sensors = replace(full, cloud_topics="points", depth_topics="depth/image_rect")
    published = [*published_topics(bootstrap, PARTICLES), *published_topics(full, PARTICLES)]
    rows = [("in", topic) for _, topic in subscriptions(sensors)]
    rows += [("out", topic) for topic in dict.fromkeys(published)]
    lines = ["| | topic | type | delivery | content |\n|---|---|---|---|---|\n"]
    lines += [
        f"| {way} | `{t.name}` | `{t.type_name}` | {t.delivery.value} | {t.meaning} |\n"
        for way, t in rows
    ]
    return MARK + "\n" + "".join(lines) + MARK


def services() -> str:
    """Return the table of services between its marks in docs/ros.md."""
    full, bootstrap = (NodeConfig(mode=mode, yaml_filename="map.yaml") for mode in Mode)
    ros2 = [*ros2_services(full), WAIT]
    ros1 = [*ros1_services(bootstrap), *ros1_services(full)]
    rows = [("ROS 2", service) for service in ros2] + [("ROS 1", service) for service in ros1]
    lines = ["| | service | type | offered | does |\n|---|---|---|---|---|\n"]
    for ros, s in dict.fromkeys(rows):
        offered = s.condition or "always"
        lines.append(f"| {ros} | `{s.name}` | `{s.type_name}` | {offered} | {s.request.value} |\n")
    return SERVICES_MARK + "\n" + "".join(lines) + SERVICES_MARK


def with_tables(text: str) -> str:
    """Return docs/ros.md with the tables between their marks brought up to date."""
    for mark, table in ((MARK, topics()), (SERVICES_MARK, services())):
        before, _, after = text.split(mark)
        text = before + table + after
    return text


def _row(parameter: Parameter) -> str:
    default = str(parameter.default)
    if isinstance(parameter.default, bool):
        default = default.lower()
    shown = f"`{default}`" if default else "empty"
    return f"| `{parameter.name}` | {shown} | {_range(parameter)} | {parameter.description} |\n"


def _range(parameter: Parameter) -> str:
    if parameter.choices:
        return ", ".join(f"`{choice}`" for choice in parameter.choices)
    least, most = parameter.least, parameter.most
    if math.isinf(least) and math.isinf(most):
        return ""
    if math.isinf(most):
        return f"{least:g} and more"
    return f"{least:g} to {most:g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    ROS_PAGE.write_text(with_tables(ROS_PAGE.read_text(encoding="utf-8")), encoding="utf-8")
