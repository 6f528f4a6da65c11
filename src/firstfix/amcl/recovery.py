"""Recovery from a wrong belief: augmented Monte Carlo localization.

Thrun, Burgard & Fox, "Probabilistic Robotics" (2005), table 8.3.
"""

from __future__ import annotations

from dataclasses import dataclass

from firstfix.amcl.config import AmclConfig


@dataclass(frozen=True, slots=True)
class WeightHistory:
    """Slow and fast running averages of the likelihood of the scans.

    Parameters
    ----------
    slow, fast : float
        The averages; 0 before the first scan.
    """

    slow: float = 0.0
    fast: float = 0.0

    def after(self, fit: float, config: AmclConfig) -> WeightHistory:
        """Return the history after one more scan.

        Parameters
        ----------
        fit : float
            Mean likelihood of a beam of the scan, 1/m.
        config : AmclConfig
            recovery_alpha_slow and recovery_alpha_fast.

        Returns
        -------
        WeightHistory
            The new averages; after the first scan both are its fit.
        """
        if self.slow == 0.0:
            return WeightHistory(fit, fit)
        return WeightHistory(
            self.slow + config.recovery_alpha_slow * (fit - self.slow),
            self.fast + config.recovery_alpha_fast * (fit - self.fast),
        )

    @property
    def injected_share(self) -> float:
        """Share of the particles to draw anew: 0 unless the fast average is below the slow one."""
        return max(0.0, 1.0 - self.fast / self.slow) if self.slow > 0.0 else 0.0
