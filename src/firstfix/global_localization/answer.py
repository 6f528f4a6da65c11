"""What every method's answer has in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firstfix.core.errors import MapError
from firstfix.core.estimate import Hypothesis, LocateResult, SearchReport, Verdict
from firstfix.core.grid import OccupancyGrid
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.fields.map_fields import MapFields
from firstfix.fields.search_grid import SPACING_M
from firstfix.global_localization.verify import Verification


def check_searchable(grid: OccupancyGrid) -> None:
    """Raise MapError if a map has nothing to compare with, or nowhere to be."""
    for kind, cells in (("occupied", grid.occupied), ("free", grid.seen_free)):
        if not cells.any():
            raise MapError(
                expected="a map with walls and free space",
                received=f"a map of {grid.width} x {grid.height} cells, none of them {kind}",
                remedy="check its thresholds, negate and image with `firstfix map check`",
            )


def check_positions(fields: MapFields) -> None:
    """Raise MapError if free space is too narrow for any position of the search."""
    if len(fields.positions) == 0:
        raise MapError(
            expected=f"free space {SPACING_M} m wide, for a robot to be in",
            received=f"{np.count_nonzero(fields.grid.seen_free)} free cells of "
            f"{fields.grid.resolution} m, nowhere together",
            remedy="check resolution and thresholds with `firstfix map check`",
        )


def nothing_to_match(scan: LaserScan, hits: int, needed: int, elapsed_s: float) -> LocateResult:
    """Answer a legal scan with fewer beams on surfaces than are needed."""
    return LocateResult(
        verdict=Verdict.NO_MATCH,
        reason=f"only {hits} of {len(scan)} beams measured a surface, {needed} are needed: "
        "blocked sensor, open space, or limits range_min and range_max that do not fit it",
        hypotheses=(),
        search=SearchReport(poses=0, searched=0.0, proven=False),
        elapsed_s=elapsed_s,
    )


def to_cells(grid: OccupancyGrid, scan: LaserScan, T_map_base: SE2) -> NDArray[np.float64]:
    """Bring a robot's pose in the map to its sensor's pose in cells: the way back of `to_map`.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Knows where the sensor sits.
    T_map_base : SE2
        The robot's pose.

    Returns
    -------
    ndarray, shape (3,)
        x, y (cells), heading (rad) of the sensor in the grid.
    """
    T_grid_laser = grid.T_map_grid.inverse() @ T_map_base @ scan.T_base_laser
    return T_grid_laser.as_array() / [grid.resolution, grid.resolution, 1.0]


def to_map(
    grid: OccupancyGrid,
    scan: LaserScan,
    pose: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> tuple[SE2, NDArray[np.float64]]:
    """Bring a sensor pose in cells to the robot's pose in the map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Knows where the sensor sits.
    pose : ndarray, shape (3,)
        x, y (cells), heading (rad) of the sensor in the grid.
    covariance : ndarray, shape (3, 3)
        Of these three.

    Returns
    -------
    SE2
        ``T_map_base``.
    ndarray, shape (3, 3)
        Covariance of x (m), y (m), yaw (rad) in the map frame.
    """
    x, y, heading = pose.tolist()
    T_grid_laser = SE2(x * grid.resolution, y * grid.resolution, heading)
    T_map_laser = grid.T_map_grid @ T_grid_laser
    T_map_base = T_map_laser @ scan.T_base_laser.inverse()
    scale = np.diag([grid.resolution, grid.resolution, 1.0])
    # A heading error swings the base around the sensor.
    lever = np.eye(3)
    lever[:2, 2] = -(T_map_base.y - T_map_laser.y), T_map_base.x - T_map_laser.x
    J = lever @ grid.T_map_grid.rotation_jacobian() @ scale
    return T_map_base, J @ covariance @ J.T


def verified_place(
    grid: OccupancyGrid,
    scan: LaserScan,
    verification: Verification,
    i: int,
    covariance: NDArray[np.float64],
    probability: float,
) -> Hypothesis:
    """Bring a pose that was verified to a hypothesis in the map.

    Parameters
    ----------
    grid : OccupancyGrid
        The map.
    scan : LaserScan
        Knows where the sensor sits.
    verification : Verification
        Of several poses.
    i : int
        Which of them it is.
    covariance : ndarray, shape (3, 3)
        Of x, y (cells), heading (rad) of the sensor in the grid.
    probability : float
        That it is the right place, 0 to 1.

    Returns
    -------
    Hypothesis
        For ``T_map_base``.
    """
    return Hypothesis(
        *to_map(grid, scan, verification.poses[i], covariance),
        score=float(verification.scores[i]),
        probability=probability,
        evidence=verification.evidence(i),
    )
