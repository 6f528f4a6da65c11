"""Whether a place is ahead of others by more than one or two things.

Beams that end on one object are not independent: a cupboard that was moved changes many of them
at once. A place that is ahead by one such object only is not certain, whatever the law of costs
makes of the mean over all beams.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import Beams
from firstfix.global_localization.verify import BEAMS, beam_weights, verify

# Of so many parts of a scan, the sixth that speaks for a place most is left out.
_PARTS = 12
_LEFT_OUT = 6

# Places, the best one included, among which it must lead clearly.
RIVALS = 8

# Rounding, nats.
_EQUAL = 1e-6

# So many beams are a part at least.
_FEWEST_BEAMS = 2


def part_costs(poses: NDArray[np.float64], beams: Beams, fields: MapFields) -> NDArray[np.float64]:
    """Return what each part of a scan costs at each pose, shape (n, parts), nats.

    Parameters
    ----------
    poses : ndarray, shape (n, 3)
        x, y (cells), heading (rad) of the sensor in the grid.
    beams : Beams
        The scan.
    fields : MapFields
        The prepared map.
    """
    used = beams.thinned(BEAMS)
    n = max(1, min(_PARTS, len(used) // _FEWEST_BEAMS))
    parts = np.array_split(np.arange(len(used)), n)
    weights = np.array([beam_weights(used)[part].sum() for part in parts])
    costs: NDArray[np.float64] = (
        np.array([verify(poses, used.take(part), fields).scores for part in parts]).T * weights
    )
    return costs


def leads_without_its_best_part(costs: NDArray[np.float64]) -> bool:
    """Tell whether the first place fits better than all others, also without a sixth of the scan.

    Parameters
    ----------
    costs : ndarray, shape (n, parts)
        Of `part_costs`, best place first; of the same scan, in any maps.
    """
    n = costs.shape[1]
    ahead = np.sort(costs[1:] - costs[0], axis=1)
    return bool((ahead[:, : n - n // _LEFT_OUT].sum(axis=1) > _EQUAL).all())
