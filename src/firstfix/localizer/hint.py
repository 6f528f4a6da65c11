"""A proposed pose, as a prior that the belief judges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from firstfix.belief.prior import Near
from firstfix.core.estimate import Hypothesis
from firstfix.core.se2 import SE2
from firstfix.global_localization.places import SAME_PLACE_M, SAME_PLACE_RAD
from firstfix.localizer.inputs import PoseHint

# Log-likelihood of the prior down to which a place counts as the hinted one.
_MATCHING = -1.0


@dataclass(frozen=True, slots=True)
class Hint:
    """A pose that was proposed.

    Parameters
    ----------
    source : str
        Where it comes from, in the words that people will read.
    prior : Near
        What it claims.
    """

    source: str
    prior: Near

    def matches(self, T_map_base: SE2) -> bool:
        """Return whether a pose is the proposed one."""
        return bool(self.prior.log_likelihood(T_map_base.as_array()[None])[0] >= _MATCHING)


def read_hint(given: PoseHint, listed: Sequence[Hypothesis]) -> Hint | None:
    """Return what an input proposes; None if it names a place that is not listed.

    Parameters
    ----------
    given : PoseHint
        The input.
    listed : sequence of Hypothesis
        The places that can be named.
    """
    if given.hypothesis_id is None:
        return Hint(given.source, Near(given.T_map_base, given.radius, given.angle))
    named = next((place for place in listed if place.id == given.hypothesis_id), None)
    if named is None:
        return None
    return Hint(given.source, Near(named.pose, SAME_PLACE_M, SAME_PLACE_RAD))
