"""The search of a whole site by a robot that moves: which scans are asked about together."""

from __future__ import annotations

import math
from dataclasses import replace

from firstfix.belief.belief import NEWS_M, NEWS_RAD, REST_M, REST_RAD
from firstfix.belief.view import View
from firstfix.site.query import SitePrior
from firstfix.site.result import SiteResult
from firstfix.site.site import Site

# Latest views that are asked about together; the search costs as much for each of them.
_VIEWS = 4


class SiteSearch:
    """Asks a site about the last views of a robot, until one place of one map is left.

    Parameters
    ----------
    site : Site
        The maps.
    prior : mapping of str to Prior or None, optional
        What is known of map and pose.
    rest_s : float
        Time between two questions while the robot rests, s.

    Attributes
    ----------
    views : list of View
        Those that are asked about together.
    """

    def __init__(self, site: Site, prior: SitePrior | None, rest_s: float) -> None:
        self._site = site
        self.prior = prior
        self._rest_s = rest_s
        self.views: list[View] = []

    def ask(self, view: View) -> SiteResult | None:
        """Return the verdict over all maps with a further view; None if it is no news.

        Parameters
        ----------
        view : View
            The newest view.
        """
        if self.views:
            step = self.views[-1].T_odom_base.inverse() @ view.T_odom_base
            metres, radians = math.hypot(step.x, step.y), abs(step.yaw)
            rests = metres < REST_M and radians < REST_RAD
            waited = not 0.0 <= view.stamp - self.views[-1].stamp < self._rest_s
            if metres < NEWS_M and radians < NEWS_RAD and not (rests and waited):
                return None
            if rests:
                self.views.pop()
        self.views = [*self.views, view][-_VIEWS:]
        scans = [replace(scan, stamp=v.stamp) for v in self.views for scan in v.scans]
        odometry = [v.T_odom_base for v in self.views for _ in v.scans]
        return self._site.locate(scans, odometry, prior=self.prior)
