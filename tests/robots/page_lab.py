"""The live page in a real browser: the server as users start it, and a Chromium that visits it."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import math
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request

# In a fresh checkout kernels are compiled first, and a busy machine is not a bug: generous, because
# a working page never takes so long.
PATIENCE_S = 240.0
_POLL_S = 0.05
_KINDNESS_S = 10.0

DESKTOP: dict[str, Any] = {"viewport": {"width": 1280, "height": 800}}
PHONE: dict[str, Any] = {
    "viewport": {"width": 360, "height": 740},
    "device_scale_factor": 3,
    "is_mobile": True,
    "has_touch": True,
}


def browser_path() -> str | None:
    """Return where a Chromium is."""
    return shutil.which("chromium", path="/usr/bin") or shutil.which("chromium")


def why_missing() -> str:
    """Return what a browser test needs and this machine lacks; empty if nothing."""
    for package in ("playwright", "axe_playwright_python"):
        if importlib.util.find_spec(package) is None:
            return f"no {package} in {sys.executable}"
    return "" if browser_path() else "no chromium in PATH"


def wait_until(
    condition: Callable[[], Any], what: Callable[[], str], seconds: float = PATIENCE_S
) -> Any:
    """Wait for something true, and return it; fail with `what` where it does not come."""
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, f"not within {seconds:g} s: {what()}"
        time.sleep(_POLL_S)
    return found


class Server:
    """`firstfix serve` in a process of its own.

    Parameters
    ----------
    *arguments : str
        After `serve`.
    """

    def __init__(self, *arguments: str) -> None:
        self._arguments = arguments
        self._port = 0
        self._process: subprocess.Popen[str] | None = None
        self.url = ""

    def start(self) -> Server:
        """Start the server, at its earlier port if it had one; return when its address is known."""
        command = [sys.executable, "-m", "firstfix", "serve", *self._arguments]
        self._process = subprocess.Popen(
            [*command, "--port", str(self._port)], stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        lines = []
        for line in self._process.stdout:
            lines.append(line)
            if found := re.search(r"http://[^\s#]+", line):
                self.url = found.group()
                self._port = urlsplit(self.url).port or 0
                return self
        raise AssertionError(f"the server ended: {lines}")

    def kill(self) -> None:
        """End it without a word."""
        self._end(signal.SIGKILL)

    def stop(self) -> None:
        """End it as a user does."""
        if self._process is not None:
            self._end(signal.SIGINT)

    def _end(self, how: signal.Signals) -> None:
        assert self._process is not None
        self._process.send_signal(how)
        try:
            self._process.wait(_KINDNESS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self._process = None

    def status(self) -> dict[str, Any]:
        """Ask where the robot is."""
        with urllib.request.urlopen(self.url + "v1/status") as answer:  # noqa: S310 - our own
            status: dict[str, Any] = json.load(answer)
        return status


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """Run a browser without a window."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_path(), args=["--no-sandbox", "--process-per-site"]
        )
        yield browser
        browser.close()


class Profiles:
    """The profiles of a browser, used again and again.

    A new profile with its new process takes longer than all else that it takes to open a page. So
    one of each kind is kept, with a page that keeps its process alive, and forgets a site before
    the next visit.
    """

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._keepers: dict[str, Page] = {}

    def like_new(self, url: str, **options: Any) -> BrowserContext:
        """Return a profile with these options of Playwright that has never been at a site."""
        kind = repr(sorted(options.items()))
        if kind not in self._keepers:
            self._keepers[kind] = self._browser.new_context(**options).new_page()
        keeper = self._keepers[kind]
        keeper.goto(f"{url.partition('#')[0]}static/light.css")
        keeper.evaluate("localStorage.clear()")
        return keeper.context


class Visit:
    """A page in a browser, and what went wrong on it.

    Parameters
    ----------
    context : BrowserContext
        Of the browser.
    url : str
        Where to go.
    color_scheme : {"light", "dark"}
        Of the system.
    is_invited : bool
        Whether the tour is offered, as at a first visit.
    """

    def __init__(
        self,
        context: BrowserContext,
        url: str,
        color_scheme: Literal["light", "dark"] = "light",
        *,
        is_invited: bool = False,
    ) -> None:
        self.problems: list[str] = []
        self._received = 0
        self._host = urlsplit(url).hostname
        self.page: Page = context.new_page()
        self.page.set_default_timeout(1000.0 * PATIENCE_S)
        self.page.emulate_media(color_scheme=color_scheme)
        if not is_invited:
            self.page.add_init_script("localStorage.setItem('firstfix-tour', 'seen')")
        self.page.on("console", self._on_message)
        self.page.on("pageerror", lambda error: self.problems.append(f"error: {error}"))
        self.page.on("request", self._see)
        self.page.goto(url)

    def _on_message(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self.problems.append(f"{message.type}: {message.text}")

    def _see(self, request: Request) -> None:
        address = urlsplit(request.url)
        if address.scheme not in {"blob", "data"} and address.hostname != self._host:
            self.problems.append(f"asks for {request.url}")

    # ---- texts of the page

    def data(self, name: str) -> str:
        """Return a data attribute of the page."""
        return self.page.get_attribute("#app", f"data-{name}") or ""

    def pose(self, name: str = "pose") -> tuple[float, ...]:
        """Return the pose it shows (or the ``truth``): x, y, yaw; empty for none."""
        return tuple(float(value) for value in self.data(name).split())

    def wait_for_state(self, *states: str) -> None:
        """Wait until the robot is in one of these states."""
        wait_until(
            lambda: self.data("state") in states,
            lambda: f"{states}, but {self.data('state')}; {self.events()[:5]}",
        )

    def wait_for_map(self) -> None:
        """Wait until there is something to see."""
        self.page.wait_for_selector("#app[data-map]")
        wait_until(lambda: self.data("view"), lambda: "a frame was drawn")

    def events(self) -> list[str]:
        """Return the timeline, newest first."""
        return self.page.locator("#events li span").all_inner_texts()

    def wait_for_fix(self) -> None:
        """Wait until a robot that is not held knows where it is."""
        self.wait_for_map()
        wait_until(lambda: self.data("state") != "CONNECTING", lambda: "no state from the robot")
        if self.page.is_visible("#paused"):
            self.page.locator("#pause").click()
        self.wait_for_state("LOCALIZED")
        self._received = len(self.events())

    def wait_for_event(self, pattern: str) -> re.Match[str]:
        """Wait for an event since the robot was found, and return what matched, newest first."""

        def found() -> re.Match[str] | None:
            texts = self.events()
            news = texts[: len(texts) - self._received]
            return next(filter(None, (re.search(pattern, text) for text in news)), None)

        match: re.Match[str] = wait_until(found, lambda: f"{pattern}; {self.events()[:8]}")
        return match

    # ---- the map

    @property
    def scale(self) -> float:
        """Return how large the map is, pixels per metre."""
        return float(self.data("view").split()[0])

    def look_at(self, x: float, y: float, scale: float = 55.0) -> None:
        """Turn the wheel over a place of the map until it is as large (pixels per metre)."""
        self.page.mouse.move(*self.pixel(x, y))
        while self.scale < scale:
            before = self.scale
            self.page.mouse.wheel(0, -200)
            wait_until(lambda: self.scale != before, lambda: "it zooms")  # noqa: B023 - used at once

    def sees(self, x: float, y: float) -> bool:
        """Return whether a place of the map is visible, not covered by bars and panels."""
        px, py = self.pixel(x, y)
        found = "([px, py]) => document.elementFromPoint(px, py)?.id === 'overlay'"
        return bool(self.page.evaluate(found, [px, py]))

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return where a place of the map is in the window."""
        scale, centre_x, centre_y, u, v = (float(value) for value in self.data("view").split())
        return u + (x - centre_x) * scale, v - (y - centre_y) * scale

    def wait_for_rest(self) -> None:
        """Wait until nothing moves: neither the robot nor the map under the eye."""
        before = ""
        while (now := f"{self.data('view')} {self.data('truth')}") != before:
            before = now
            self.page.wait_for_timeout(400)
            self.wait_for_frames()

    def wait_for_frames(self) -> None:
        """Wait until the page was drawn several times, however slow the machine is."""
        self.page.evaluate("""() => new Promise((done) => {
            let left = 5;
            const next = () => (left-- ? requestAnimationFrame(next) : done());
            next();
        })""")

    def press_and_pull(self, x: float, y: float, yaw: float, length_px: float = 60.0) -> None:
        """Press at a place of the map and pull in a direction."""
        px, py = self.pixel(x, y)
        mouse = self.page.mouse
        mouse.move(px, py)
        mouse.down()
        for step in (0.3, 0.7, 1.0):
            reach = length_px * step
            mouse.move(px + reach * math.cos(yaw), py - reach * math.sin(yaw))
        mouse.up()

    def click_on_map(self, x: float, y: float) -> None:
        """Click a place of the map."""
        self.page.mouse.click(*self.pixel(x, y))

    def colour(self, canvas: str, x: float, y: float) -> tuple[int, ...]:
        """Return the colour (r, g, b, a) of a canvas at a place of the map."""
        # Through a copy: browsers draw a canvas that is read often more slowly, and warn.
        script = """([canvas, px, py]) => {
            const found = document.getElementById(canvas);
            const ratio = found.width / found.clientWidth;
            const copy = new OffscreenCanvas(1, 1).getContext("2d");
            copy.drawImage(found, -Math.floor(px * ratio), -Math.floor(py * ratio));
            return [...copy.getImageData(0, 0, 1, 1).data];
        }"""
        return tuple(self.page.evaluate(script, [canvas, *self.pixel(x, y)]))

    def colour_of(self, selector: str) -> str:
        """Return the colour of a text, as rgb(...)."""
        element = f"document.querySelector({selector!r})"
        return str(self.page.evaluate(f"getComputedStyle({element}).color"))

    def colour_variable(self, name: str) -> str:
        """Return a colour of the style sheet by its name, as rgb(...)."""
        script = """(name) => {
            const probe = document.createElement("i");
            probe.style.color = `var(--${name})`;
            document.body.append(probe);
            const { color } = getComputedStyle(probe);
            probe.remove();
            return color;
        }"""
        return str(self.page.evaluate(script, name))

    def shot(self, path: Path) -> None:
        """Take a picture, for people to look at."""
        self.page.screenshot(path=path)
