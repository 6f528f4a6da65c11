"""A picture of a site: which maps are taken for which."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from firstfix.lab.experiments.site_check import SiteCheck
from firstfix.plots.figure import new_figure, save_figure

# More names than this cannot be read beside a matrix.
_MOST_NAMES = 60


def draw_site(found: SiteCheck, path: Path) -> Path:
    """Draw the share of the scans of each map (row) that fit in each other map (column)."""
    names = [one.id for one in found.maps]
    index = {name: i for i, name in enumerate(names)}
    shares = np.zeros((len(names), len(names)))
    for one in found.maps:
        shares[index[one.id], index[one.id]] = one.right / max(1, one.scans)
    scans = {one.id: max(1, one.scans) for one in found.maps}
    for pair in found.alike:
        shares[index[pair.map_id], index[pair.other]] = pair.scans / scans[pair.map_id]
    side = min(16.0, 4.0 + 0.2 * len(names))
    figure = new_figure(side, side)
    axes = figure.subplots()
    image = axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    figure.colorbar(image, ax=axes, shrink=0.7, label="share of the scans that fit")
    axes.set_xlabel("in this map")
    axes.set_ylabel("scans of this map")
    if len(names) <= _MOST_NAMES:
        axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
        axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set_title(f"{len(names)} maps: off the diagonal, maps look alike")
    return save_figure(figure, path)
