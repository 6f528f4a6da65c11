"""How many unexplained views it takes until the earlier ones say nothing."""

import numpy as np
import pytest

from firstfix.belief.judge import Favourite
from firstfix.belief.misses import MOST_MISSES, has_missed_enough
from firstfix.belief.view import Link, Observation, View
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2

SCAN = LaserScan(np.full(90, 2.0), -1.5, 0.03, 0.1, 10.0)


def window(*links: Link) -> list[Observation]:
    return [Observation((View((SCAN,), SE2.identity()),), 0.05, link=link) for link in links]


GOING_ON = window(*[Link.GOES_ON] * 10)
PUBLISHED, HOPED = (Favourite(3, GOING_ON[0], is_published) for is_published in (True, False))


@pytest.mark.parametrize(
    ("views", "favourite", "needed"),
    [
        (GOING_ON, None, MOST_MISSES),
        (GOING_ON, HOPED, MOST_MISSES),
        (GOING_ON, PUBLISHED, 8),
        (window(*[Link.GOES_ON] * 7, Link.BROKEN), PUBLISHED, MOST_MISSES),
        (window(Link.UNKNOWN, *[Link.GOES_ON] * 7), PUBLISHED, MOST_MISSES),
        (window(Link.BROKEN, *[Link.GOES_ON] * 8), PUBLISHED, 8),  # carried long ago
    ],
)
def test_a_published_place_is_kept_longer_while_views_go_on_from_each_other(
    views: list[Observation], favourite: Favourite | None, needed: int
) -> None:
    enough = [misses for misses in range(12) if has_missed_enough(misses, views, favourite)]
    assert enough == list(range(needed, 12))
