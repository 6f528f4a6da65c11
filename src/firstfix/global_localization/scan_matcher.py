"""Global localization of one scan in one map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from firstfix.core.arguments import as_instance, as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.estimate import Hypothesis, LocateResult
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.exhaustive import BASIC, FAST, ExhaustiveSearch
from firstfix.global_localization.locate import locate
from firstfix.global_localization.prior import Prior, check_prior
from firstfix.global_localization.scoring import score_poses, search_locally
from firstfix.global_localization.searchable import check_positions, check_searchable
from firstfix.global_localization.sensors import at_one_time, instants


class ScanMatcher:
    """Locates scans anywhere in one map, without an initial pose.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    method : Method or str
        How to search: ``"fast"``, ``"paper"`` or ``"paper-basic"``.
    config : LocateConfig, optional
        Settings of the default method.
    cache_dir : Path, optional
        Folder of prepared maps, such as `firstfix.fields.cache.cache_folder`; by default the map is
        prepared anew.
    fields : MapFields, optional
        The map with its fields, where another part of the program has them.

    Raises
    ------
    InputError
        If an argument has the wrong type, or no method has this name.
    MapError
        If the map has no wall, or no free space to be in.

    Examples
    --------
    >>> matcher = ff.ScanMatcher(grid)
    >>> result = matcher.locate(scan)
    >>> result.verdict
    <Verdict.UNIQUE: 'UNIQUE'>
    >>> result.best.pose.distance_to(ff.SE2(2.0, 1.5, 0.5)) < 0.05
    True
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        method: Method | str = Method.FAST,
        config: LocateConfig | None = None,
        cache_dir: Path | None = None,
        fields: MapFields | None = None,
    ) -> None:
        check_searchable(as_instance(OccupancyGrid, grid, "grid"))
        self.method = as_member(Method, method, "method")
        self.config = as_instance(LocateConfig, config or LocateConfig(), "config")
        self.fields = MapFields(grid, cache_dir) if fields is None else fields
        self._exhaustive: ExhaustiveSearch | None = None
        if self.method is Method.FAST:
            check_positions(self.fields)
            self.fields.compute_for_search()
        else:
            poses = FAST if self.method is Method.PAPER else BASIC
            self._exhaustive = ExhaustiveSearch(self.fields, poses)
            self.fields.compute("pointscore", "squares", "clearance")

    def locate(
        self,
        scan: Scans,
        T_odom_base: Sequence[SE2] | None = None,
        prior: Prior | None = None,
    ) -> LocateResult:
        """Find where in the map a scan was taken, or the newest of several.

        Parameters
        ----------
        scan : LaserScan or sequence of LaserScan
            One scan, with the sensor's pose on the robot. Or one scan of each sensor, in any order.
            Or several scans of each, oldest first, of a robot that stood, turned or drove a little.
            All are judged together.
        T_odom_base : sequence of SE2, optional
            Odometry at each of several scans; by default the robot stood still.
        prior : Prior, optional
            What is known of the pose at the first scan: `Near`, `Region`, `AnyOf`, `All`. Strong
            evidence of the scan overrules it.

        Returns
        -------
        LocateResult
            Verdict and ranked hypotheses for ``T_map_base`` at the newest scan.

        Raises
        ------
        InputError
            If several scans and their odometry do not belong together, the prior does not fit the
            map, or the method takes one scan only and no prior.
        """
        scans = as_scans(scan)
        if prior is not None:
            check_prior(prior, self.fields.grid)
        if self._exhaustive is not None:
            result = self._locate_by_paper(scans, prior)
        elif len(scans) == 1:
            result = locate(scans, self.fields, self.config, prior)
        else:
            result = self._locate_several(scans, T_odom_base, prior)
        return replace(result, grid=self.fields.grid, scans=result.scans or scans)

    def __repr__(self) -> str:
        return f"<ScanMatcher {self.method.value} in {self.fields.grid!r}>"

    def _locate_by_paper(self, scans: tuple[LaserScan, ...], prior: Prior | None) -> LocateResult:
        assert self._exhaustive is not None  # noqa: S101 - by the caller
        if len(scans) > 1 or prior is not None:
            what = "several scans" if len(scans) > 1 else "a prior"
            raise InputError(
                expected=f'method "fast" for {what}',
                received=f'method "{self.method.value}"',
                remedy="give one scan alone, or use the default method",
            )
        return replace(self._exhaustive.locate(scans[0]), scans=scans)

    def _locate_several(
        self,
        scans: Sequence[LaserScan],
        T_odom_base: Sequence[SE2] | None,
        prior: Prior | None,
    ) -> LocateResult:
        # The belief is built on this package; only this method of the matcher is built on it.
        from firstfix.belief.several import locate_several

        odometry = [SE2.identity()] * len(scans) if T_odom_base is None else T_odom_base
        poses = [as_pose(pose, "T_odom_base") for pose in odometry]
        if len(instants(scans)) == 1:
            return locate(at_one_time(scans, poses), self.fields, self.config, prior)
        return locate_several(scans, poses, self.fields, prior)

    def score_poses(self, scan: Scans, poses: Sequence[SE2]) -> tuple[Hypothesis, ...]:
        """Score poses by a scan: `firstfix.global_localization.scoring.score_poses`.

        Parameters
        ----------
        scan : LaserScan or sequence of LaserScan
            The scan, with the sensor's pose on the robot; or one scan of each sensor.
        poses : sequence of SE2
            ``T_map_base`` proposed; at least one.

        Returns
        -------
        tuple of Hypothesis
            One for each pose; the probability is that of the place against a wrong map.
        """
        return score_poses(as_scans(scan), [as_pose(pose, "pose") for pose in poses], self.fields)

    def search_locally(self, scan: Scans, T_map_base: SE2) -> Hypothesis:
        """Find the best pose within about a metre and 40 degrees of a given one.

        Parameters
        ----------
        scan : LaserScan or sequence of LaserScan
            The scan, with the sensor's pose on the robot; or one scan of each sensor.
        T_map_base : SE2
            Where to look.

        Returns
        -------
        Hypothesis
            The best; its probability is that of the place against a wrong map.
        """
        return search_locally(as_scans(scan), as_pose(T_map_base, "T_map_base"), self.fields)
