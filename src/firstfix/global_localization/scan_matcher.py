"""Global localization of one scan in one map."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firstfix.core.arguments import as_instance, as_member, as_pose
from firstfix.core.errors import InputError
from firstfix.core.estimate import Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan, Scans, as_scans
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.global_localization.beams import FEWEST_HITS
from firstfix.global_localization.config import LocateConfig, Method
from firstfix.global_localization.exhaustive import BASIC, FAST, ExhaustiveSearch
from firstfix.global_localization.lead import leads_without_its_best_part
from firstfix.global_localization.look import find_places
from firstfix.global_localization.places import distinct_places
from firstfix.global_localization.prior import (
    SHARE_OF_SMALL_VIEW,
    SHARE_WITHOUT_PRIOR,
    PlacePrior,
    Prior,
    check_prior,
)
from firstfix.global_localization.refine import refine_on_field, refine_on_rays
from firstfix.global_localization.scoring import score_poses, search_locally
from firstfix.global_localization.searchable import check_positions, check_searchable
from firstfix.global_localization.sensors import (
    are_surrounded,
    at_one_time,
    instants,
    joint_beams,
    see_enough,
)
from firstfix.global_localization.verdict import (
    RIVAL_SHARE,
    judge,
    log_likelihoods,
    nothing_to_match,
    place_probabilities,
)
from firstfix.global_localization.verify import Verification, verified_place, verify

# A third of the beams rejects most places; all beams rank the rest.
FIRST_LOOK_BEAMS = 60
SECOND_LOOK_PLACES = 48

# This many places are listed however unlikely, and all that are a hundredth as likely as the best.
LISTED_PLACES = 10
_LISTED_SHARE = 0.01

_SEES_TOO_LITTLE = (
    "but one scan of a sensor with this field of view and range is not enough to be sure: "
    "drive half a metre or turn, and give several scans"
)


# Places, the best one included, among which it must lead clearly.
_RIVALS = 8

_DIFFERS_IN_LITTLE = (
    "but only by one or two things, which may have been moved: "
    "drive or turn, and give several scans"
)


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


def locate(
    scans: Sequence[LaserScan],
    fields: MapFields,
    config: LocateConfig,
    prior: Prior | None = None,
) -> LocateResult:
    """Search, refine, verify, judge.

    Parameters
    ----------
    scans : sequence of LaserScan
        One of each sensor, with its pose on the robot.
    fields : MapFields
        The prepared map.
    config : LocateConfig
        Settings.
    prior : Prior, optional
        Of the pose of the base in the map.

    Returns
    -------
    LocateResult
        Verdict and ranked hypotheses for ``T_map_base``.
    """
    started = time.perf_counter()
    resolution = fields.grid.resolution
    scan, beams = joint_beams(scans)
    hits = int(np.count_nonzero(beams.hit))
    if hits < FEWEST_HITS:
        return nothing_to_match(
            sum(map(len, scans)), hits, FEWEST_HITS, time.perf_counter() - started
        )

    known = PlacePrior(prior, fields.grid, scan, len(beams))
    depth = known.depth(config.shortlist)
    candidates, report = find_places(beams, fields, depth, config.max_poses)
    poses = refine_on_field(known.chosen(candidates.poses, config.shortlist), beams, fields)
    first_look = verify(poses, beams.thinned(FIRST_LOOK_BEAMS), fields)
    best = [
        distinct_places(poses, scores, resolution, SECOND_LOOK_PLACES)
        for scores in known.rankings(first_look)
    ]
    second_look = verify(poses[_united(best)], beams, fields)
    poses, best = second_look.poses, []
    for scores in known.rankings(second_look):
        ranked = distinct_places(poses, scores, resolution, config.hypotheses)
        best.append(ranked[: worth_listing(scores[ranked], len(beams))])
    poses = poses[_united(best)]
    on_rays, covariances = refine_on_rays(poses, beams, fields)
    # Rays are more precise, but worse in a map with smeared walls: keep the better pose of the two.
    poses = np.concatenate([on_rays, poses])
    covariances = np.concatenate([covariances, covariances])
    verification = verify(poses, beams, fields)
    weighed = known.rankings(verification)[0]
    ranked = distinct_places(poses, weighed, resolution, config.hypotheses)
    probabilities = place_probabilities(weighed[ranked], len(beams))

    hypotheses = tuple(
        verified_place(fields.grid, scan, verification, int(i), covariances[i], float(probability))
        for i, probability in zip(ranked, probabilities, strict=True)
    )
    verdict, reason = _judge(verification, ranked, probabilities, report, config)
    # A prior is a second witness.
    if verdict is Verdict.UNIQUE and not known.speaks_for(poses[ranked[0]]):
        if not (see_enough(scans) or are_surrounded(scans)):
            verdict, reason = Verdict.AMBIGUOUS, f"{reason}, {_SEES_TOO_LITTLE}"
        elif not leads_without_its_best_part(poses[ranked[:_RIVALS]], beams, fields):
            verdict, reason = Verdict.AMBIGUOUS, f"{reason}, {_DIFFERS_IN_LITTLE}"
    result = LocateResult(verdict, reason, hypotheses, report, 0.0, scans=tuple(scans))
    if prior is not None:
        by_scan = distinct_places(poses, verification.scores, resolution, config.hypotheses)
        alone = place_probabilities(verification.scores[by_scan], len(beams))
        logs = log_likelihoods(verification.scores[[ranked[0], by_scan[0]]], len(beams))
        needed = SHARE_WITHOUT_PRIOR if see_enough(scans) else SHARE_OF_SMALL_VIEW
        ratio = float(np.exp(logs[0] - logs[1]))
        result = _with_share_of_prior(result, float(alone[0]), ratio, needed)
    return replace(result, elapsed_s=time.perf_counter() - started)


def _united(rankings: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Return the indices of all rankings, in the order of the first one where it is the only."""
    return rankings[0] if len(rankings) == 1 else np.unique(np.concatenate(rankings))


def _with_share_of_prior(
    result: LocateResult, favourite: float, ratio: float, needed: float
) -> LocateResult:
    """State how likely the best place is by the scan alone; a prior decides nothing by itself.

    A prior chooses among places that the scan cannot tell apart. If it is wrong, it chooses a place
    that looks like the true one.

    Parameters
    ----------
    result : LocateResult
        By scan and prior.
    favourite : float
        Probability of the best place by the scan alone.
    ratio : float
        Likelihood of the best place of the result against that one, by the scan alone.
    needed : float
        Least probability by the scan alone for UNIQUE.
    """
    alone, both = favourite * ratio, result.hypotheses[0].probability
    reason = f"{result.reason}; {alone:.0%} likely by the scan alone, {both:.0%} with the prior"
    verdict = result.verdict
    if verdict is Verdict.UNIQUE and alone < needed:
        verdict = Verdict.AMBIGUOUS
        reason = (
            f"the prior chooses this place ({both:.0%} likely with it, {alone:.0%} by the scan "
            "alone): a second view can confirm it"
        )
        if ratio < RIVAL_SHARE:
            reason = f"the scan fits {1.0 / ratio:.0f} times better elsewhere than near the prior"
    return replace(result, verdict=verdict, reason=reason, probability_without_prior=alone)


def worth_listing(scores: NDArray[np.float64], beams: int) -> int:
    """Return how many of some ranked places a result should list.

    Parameters
    ----------
    scores : ndarray, shape (n,)
        Mean cost of a beam at each place, best first, nats.
    beams : int
        Number of beams behind each mean.

    Returns
    -------
    int
        `LISTED_PLACES`, or more if more are a hundredth as likely as the best.
    """
    probabilities = place_probabilities(scores, beams)
    return max(
        LISTED_PLACES, int(np.count_nonzero(probabilities >= _LISTED_SHARE * probabilities[0]))
    )


def _judge(
    verification: Verification,
    ranked: NDArray[np.int64],
    probabilities: NDArray[np.float64],
    report: SearchReport,
    config: LocateConfig,
) -> tuple[Verdict, str]:
    verdict, reason = judge(
        probabilities, verification.evidence(int(ranked[0])), config.unique_probability
    )
    if report.searched == 1.0:
        return verdict, reason
    # The part that was not searched may contain a better place.
    unseen = f"; max_poses left {1.0 - report.searched:.0%} of the map unsearched"
    return (Verdict.AMBIGUOUS if verdict is Verdict.UNIQUE else verdict), reason + unseen
