"""Odometry without the steps that two consecutive scans contradict."""

from __future__ import annotations

from dataclasses import replace

from firstfix.belief.scan_step import judge_step
from firstfix.belief.view import View
from firstfix.core.se2 import SE2

# Scans nearer in time, s, are compared with the same one before: a longer step is seen better.
_LEAST_APART_S = 0.19


class CheckedOdometry:
    """Follows the odometry from scan to scan; a contradicted step is replaced by that of the scans.

    Examples
    --------
    >>> odometry = CheckedOdometry()
    >>> believed = odometry.check(View.of(scan, T_odom_base))
    >>> believed.T_odom_base == T_odom_base
    True
    """

    def __init__(self) -> None:
        self._before: View | None = None  # with the odometry that is believed
        self._T_checked_odom = SE2.identity()
        self._unconfirmed = 0

    @property
    def T_checked_odom(self) -> SE2:
        """The frame of the odometry now, in one in which no step was contradicted."""
        return self._T_checked_odom

    def restart(self) -> None:
        """Begin anew: the odometry frame is another one."""
        self._before, self._T_checked_odom = None, SE2.identity()
        self._unconfirmed += 1

    def check(self, view: View) -> View:
        """Return a view with the odometry that is believed, and the unconfirmed steps so far.

        Parameters
        ----------
        view : View
            With the odometry as it came.
        """
        T_odom_base, before = self._T_checked_odom @ view.T_odom_base, self._before
        checked = replace(view, T_odom_base=T_odom_base, unconfirmed=self._unconfirmed)
        if before is not None:
            step = judge_step(before, checked)
            self._unconfirmed += not step.is_confirmed
            if step.by_scans is not None:
                T_odom_base = before.T_odom_base @ step.by_scans
                self._T_checked_odom = T_odom_base @ view.T_odom_base.inverse()
            checked = replace(checked, T_odom_base=T_odom_base, unconfirmed=self._unconfirmed)
        if before is None or not 0.0 <= view.stamp - before.stamp < _LEAST_APART_S:
            self._before = checked
        return checked
