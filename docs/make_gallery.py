"""Runs docs/gallery.md and draws its pictures anew: ``python docs/make_gallery.py``."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image, ImageChops, ImageOps

PAGE = Path(__file__).parent / "gallery.md"
FOLDER = Path(__file__).parent / "gallery"
PROGRAM = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^    (firstfix .* --plot (\S+))$", re.MULTILINE)
MOST_PIXELS = 1000  # of the longer side
COLOURS = 128
MARGIN = 10


def main() -> None:
    """Run the program of the page, then each command, and keep the pictures."""
    FOLDER.mkdir(exist_ok=True)
    page = PAGE.read_text(encoding="utf-8")
    with TemporaryDirectory() as folder:
        for program in PROGRAM.findall(page):
            subprocess.run([sys.executable, "-c", program], cwd=folder, check=True)  # noqa: S603
        for command, picture in COMMAND.findall(page):
            done = subprocess.run(  # noqa: S603
                [sys.executable, "-m", *shlex.split(command)], cwd=folder, check=False
            )
            if done.returncode not in (0, 1):  # 1: a verdict other than UNIQUE
                sys.exit(f"{command} ended with {done.returncode}")
            keep(Path(folder) / picture, FOLDER / picture)


def keep(drawn: Path, kept: Path) -> None:
    """Cut white margins off, and make the file small."""
    image = Image.open(drawn).convert("RGB")
    box = ImageChops.invert(image).getbbox()
    if box is not None:
        image = ImageOps.expand(image.crop(box), MARGIN, "white")
    image.thumbnail((MOST_PIXELS, MOST_PIXELS))
    # Rare colours, such as those of a few beams, keep their place.
    few = image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(kept, optimize=True)


if __name__ == "__main__":
    main()
