"""Record some 20 seconds of the live page for the README: found, driven, carried away, found again.

Runs `firstfix demo`, visits it with a Chromium without a window, does what a person would do, and
writes a GIF.

    python benchmarks/record_demo.py [docs/demo.gif]
"""

from __future__ import annotations

import argparse
import base64
import contextlib
import io
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Page, ViewportSize

WINDOW: ViewportSize = {"width": 1280, "height": 720}
PICTURE = (960, 540)
FRAMES_A_SECOND = 6
COLOURS = 64
PAGE_COLOURS = Path("src/firstfix/web/static/light.css")

# The robot of this seed wakes up at (22.3, 0.9) m.
DEMO = ("demo", "--world", "office", "--seed", "1", "--port", "0")
FIRST_GOAL = (23.2, 3.4)
PUT_DOWN = (4.6, 18.6, -0.5)
SECOND_GOAL = (5.6, 15.2)

# A browser without a window draws no pointer; shadows need more colours than a GIF should have.
STAGE = """() => {
    document.documentElement.style.setProperty("--shadow", "none");
    const pointer = document.createElement("div");
    Object.assign(pointer.style, {
        position: "fixed", zIndex: 99, width: "18px", height: "18px", margin: "-9px",
        borderRadius: "50%", pointerEvents: "none", background: "rgb(20 30 40 / 45%)",
        border: "2px solid white", left: "640px", top: "420px",
    });
    document.body.append(pointer);
    addEventListener("pointermove", ({ clientX, clientY }) => {
        pointer.style.left = `${clientX}px`;
        pointer.style.top = `${clientY}px`;
    }, true);
}"""


@contextlib.contextmanager
def demo() -> Iterator[str]:
    """Run the demo; gives the address of its page."""
    command = [sys.executable, "-m", "firstfix", *DEMO]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        lines = iter(process.stdout or [])
        found = (re.search(r"http://\S+", line) for line in lines)
        yield next(address.group() for address in found if address)
        process.terminate()


class Film:
    """Pictures of a page as they are drawn, each with its time."""

    def __init__(self, page: Page) -> None:
        self.pictures: list[tuple[float, Image.Image]] = []
        self._is_over = False
        self._session = page.context.new_cdp_session(page)
        self._session.on("Page.screencastFrame", self._take)
        self._session.send("Page.startScreencast", {"format": "png", "everyNthFrame": 2})

    def _take(self, frame: dict[str, Any]) -> None:
        if self._is_over:
            return
        picture = Image.open(io.BytesIO(base64.b64decode(frame["data"]))).convert("RGB")
        self.pictures.append((frame["metadata"]["timestamp"], picture))
        self._session.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})

    def stop(self) -> None:
        """Take no more."""
        self._is_over = True
        self._session.send("Page.stopScreencast")


class Hand:
    """What a person does on the page, in the time that a person takes for it."""

    def __init__(self, page: Page) -> None:
        self._page = page

    def wait(self, seconds: float) -> None:
        """Look on."""
        self._page.wait_for_timeout(1000 * seconds)

    def press_button(self, selector: str) -> None:
        """Go to a button and press it."""
        middle = """(button) => {
            const { x, y, width, height } = button.getBoundingClientRect();
            return [x + width / 2, y + height / 2];
        }"""
        self._go(*self._page.locator(selector).evaluate(middle))
        self._page.mouse.down()
        self._page.mouse.up()

    def click(self, x: float, y: float) -> None:
        """Click a place of the map (m)."""
        self._go(*self._pixel(x, y))
        self._page.mouse.down()
        self._page.mouse.up()

    def press_and_pull(self, x: float, y: float, yaw: float) -> None:
        """Press at a place of the map (m) and pull in a direction (rad)."""
        px, py = self._pixel(x, y)
        self._go(px, py)
        self._page.mouse.down()
        self._go(px + 70.0 * math.cos(yaw), py - 70.0 * math.sin(yaw))
        self.wait(0.3)
        self._page.mouse.up()

    def _go(self, px: float, py: float) -> None:
        self._page.mouse.move(px, py, steps=5)

    def _pixel(self, x: float, y: float) -> tuple[float, float]:
        view = self._page.get_attribute("#app", "data-view") or ""
        scale, middle_x, middle_y, u, v = (float(value) for value in view.split())
        return u + (x - middle_x) * scale, v - (y - middle_y) * scale


def act(page: Page) -> None:
    """Play the story."""
    hand = Hand(page)
    page.wait_for_selector("#app[data-state=LOCALIZED]")
    hand.wait(1.0)
    hand.press_button("#mode-goal")
    hand.click(*FIRST_GOAL)
    hand.wait(3.5)
    hand.press_button("#mode-carry")
    hand.press_and_pull(*PUT_DOWN)
    page.wait_for_selector("#app[data-state=LIFTED]")
    page.wait_for_selector("#app[data-state=LOCALIZED]")
    hand.wait(1.5)
    hand.press_button("#mode-goal")
    hand.click(*SECOND_GOAL)
    hand.wait(3.0)


def record(address: str) -> list[tuple[float, Image.Image]]:
    """Visit the demo; returns pictures with their times, s."""
    from playwright.sync_api import sync_playwright

    browser_path = shutil.which("chromium", path="/usr/bin") or shutil.which("chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page(viewport=WINDOW, color_scheme="light")
        page.add_init_script("localStorage.setItem('firstfix-tour', 'seen')")  # not offered here
        page.goto(address)
        page.wait_for_selector("#app[data-view]")
        page.evaluate(STAGE)
        film = Film(page)
        act(page)
        film.stop()
        browser.close()
    return film.pictures


def evenly(pictures: list[tuple[float, Image.Image]]) -> list[Image.Image]:
    """Choose what was to be seen at each frame of the film."""
    began, ended = pictures[0][0], pictures[-1][0]
    frames = []
    for k in range(int((ended - began) * FRAMES_A_SECOND)):
        seen = [picture for time, picture in pictures if time <= began + k / FRAMES_A_SECOND]
        frames.append(seen[-1].resize(PICTURE, Image.Resampling.LANCZOS))
    return frames


def in_few_colours(frames: list[Image.Image]) -> list[Image.Image]:
    """Paint all frames in the same few colours, so that what stays needs no bytes.

    Those of the page come first: among all pixels the beams are so few that none would be theirs.
    """
    channels = [
        int(found[i : i + 2], 16)
        for found in sorted(set(re.findall(r"#([0-9a-f]{6});", PAGE_COLOURS.read_text())))
        for i in (0, 2, 4)
    ]
    seen = np.concatenate([np.asarray(frame) for frame in frames[:: max(len(frames) // 10, 1)]])
    mixed = Image.fromarray(seen).quantize(COLOURS, Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*channels, *mixed][: 3 * COLOURS])
    return [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", nargs="?", type=Path, default=Path("docs/demo.gif"))
    path: Path = parser.parse_args().path
    with demo() as address:
        pictures = record(address)
    frames = in_few_colours(evenly(pictures))
    first, *others = frames
    first.save(
        path,
        save_all=True,
        append_images=others,
        duration=1000 // FRAMES_A_SECOND,
        loop=0,
        optimize=False,
    )
    print(
        f"{path}: {len(frames)} frames of {len(pictures)} that were drawn, "
        f"{len(frames) / FRAMES_A_SECOND:.1f} s, {path.stat().st_size / 1e6:.2f} MB"
    )


if __name__ == "__main__":
    main()
