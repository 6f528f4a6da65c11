"""A simulated drive as a log."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from firstfix.core.odometry import Odometry
from firstfix.core.recording import Recording
from firstfix.core.scan import LaserScan
from firstfix.core.trajectory import Trajectory
from firstfix.lab.simulation.simulation import Moment


def record(moments: Iterable[Moment]) -> Recording:
    """Collect what a robot reported, with the true pose at each scan, as one drive.

    The notes say when the robot was disturbed. Signals are not kept.

    Raises
    ------
    ScanError
        If there is no scan.
    """
    scans: list[LaserScan] = []
    truth, stamps, odometry, notes = [], [], [], []
    for moment in moments:
        if moment.disturbance is not None:
            notes.append(f"{moment.disturbance.value} until {moment.stamp:.1f} s")
        for event in moment.events:
            if isinstance(event, LaserScan):
                scans.append(event)
                truth.append(moment.T_map_base.as_array())
            elif isinstance(event, Odometry):
                stamps.append(event.stamp)
                odometry.append(event.T_odom_base.as_array())
    return Recording(
        scans=tuple(scans),
        odometry=Trajectory(np.array(stamps), np.array(odometry).reshape(-1, 3)),
        truth=np.array(truth).reshape(-1, 3),
        notes=tuple(notes),
    )
