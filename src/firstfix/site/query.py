"""What is asked of a site: scans, odometry, and what is known before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from firstfix.belief.several import check_sequence
from firstfix.core.arguments import as_pose
from firstfix.core.errors import InputError
from firstfix.core.scan import LaserScan, as_scans
from firstfix.core.se2 import SE2
from firstfix.global_localization.prior import Prior
from firstfix.global_localization.sensors import at_one_time, instants

SitePrior = Mapping[str, "Prior | None"]
"""Maps in which the robot may be, and what is known of its pose in each (None: nothing)."""


@dataclass(frozen=True, eq=False)
class SiteQuery:
    """Scans of one robot. Made by `SiteQuery.of`; can be pickled.

    Parameters
    ----------
    scans : tuple of LaserScan
        Oldest first, at least one.
    T_odom_base : tuple of SE2
        Odometry at each scan.
    prior : mapping of str to Prior or None
        Maps in which the robot may be; None if it may be in any.
    """

    scans: tuple[LaserScan, ...]
    T_odom_base: tuple[SE2, ...]
    prior: SitePrior | None = None

    @classmethod
    def of(
        cls,
        scan: LaserScan | Sequence[LaserScan],
        T_odom_base: Sequence[SE2] | None = None,
        prior: SitePrior | None = None,
    ) -> SiteQuery:
        """Check and put together what `Site.locate` takes.

        Raises
        ------
        InputError
            If there is no scan, scans and odometry do not belong together, or the prior is no
            mapping from maps to priors.
        """
        scans = as_scans(scan)
        odometry = [SE2.identity()] * len(scans) if T_odom_base is None else T_odom_base
        poses = tuple(as_pose(pose, "T_odom_base") for pose in odometry)
        if prior is not None and not isinstance(prior, Mapping):
            raise InputError(
                "The prior of a site names maps. Pass a mapping such as {'ground': None} or "
                "{'ground': ff.Near((2, 1, 0), radius=3)}."
            )
        if len(instants(scans)) > 1:
            check_sequence(scans, poses)
        elif len(scans) > 1:
            scans, poses = at_one_time(scans, poses), (poses[-1],) * len(scans)
        return cls(scans, poses, None if prior is None else dict(prior))

    @property
    def is_one_look(self) -> bool:
        """True for one scan of each sensor, False for several in a row."""
        return len(instants(self.scans)) == 1

    def prior_in(self, map_id: str) -> Prior | None:
        """Return what is known of the pose in one map."""
        return None if self.prior is None else self.prior.get(map_id)
