"""The picture of the demo."""

from __future__ import annotations

from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.global_localization.precompile import small_room
from firstfix.lab.reports.scenario_picture import draw_scenario
from firstfix.lab.scenarios.demo import DemoStep


def demo_steps() -> list[DemoStep]:
    def step(i: int, episode: int, *, published: bool) -> DemoStep:
        pose = SE2(1.0 + 0.1 * i, 2.0 + episode, 0.0)
        found = pose if i == 0 else None
        return DemoStep(
            i + 10.0 * episode, pose, pose if published else None, found, episode, False, 0
        )

    return [step(i, episode, published=i % 4 != 3) for episode in range(3) for i in range(12)]


@pytest.mark.slow
def test_a_demo_is_drawn(tmp_path: Path) -> None:
    path = draw_scenario(small_room(), demo_steps(), tmp_path / "demo.png")
    assert path == tmp_path / "demo.png"
    assert path.read_bytes().startswith(b"\x89PNG")
    svg = draw_scenario(small_room(), demo_steps(), tmp_path / "demo.svg").read_text()
    for words in ("truth", "published", "carried away", "found"):
        assert words in svg


def test_a_demo_without_any_pose_is_drawn(tmp_path: Path) -> None:
    steps = [DemoStep(0.1 * i, SE2(2.0, 2.0, 0.0), None, None, 0, False, 0) for i in range(3)]
    assert draw_scenario(small_room(), steps, tmp_path / "none.png").exists()


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError):
        draw_scenario(small_room(), demo_steps(), tmp_path / "file" / "demo.png")
