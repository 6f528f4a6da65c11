"""The first look: how promising each map is."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Looked:
    """What a first look at maps says. Can be pickled.

    Parameters
    ----------
    map_ids : tuple of str
        The maps that were looked at.
    scores : ndarray, shape (n,)
        Score of the best position of each, m; lower is better.
    recall : float
        Probability that the right map is among `promising`, measured on other buildings.
    most : int
        Number of maps in `promising`; may be more than there are in this part of the site.
    """

    map_ids: tuple[str, ...]
    scores: NDArray[np.float64]
    recall: float
    most: int

    @property
    def promising(self) -> tuple[str, ...]:
        """The maps that are worth a search, best first."""
        order = np.argsort(self.scores, kind="stable")[: self.most]
        return tuple(self.map_ids[i] for i in order)

    @classmethod
    def joined(cls, parts: Sequence[Looked]) -> Looked:
        """Put the looks at parts of a site together.

        Parameters
        ----------
        parts : sequence of Looked
            At different maps of one site; at least one.
        """
        return cls(
            map_ids=tuple(name for part in parts for name in part.map_ids),
            scores=np.concatenate([part.scores for part in parts]),
            recall=min(part.recall for part in parts),
            most=max(part.most for part in parts),
        )


def look_at_all(map_ids: Sequence[str]) -> Looked:
    """Find every map promising."""
    return Looked(tuple(map_ids), np.zeros(len(map_ids)), recall=1.0, most=sys.maxsize)
