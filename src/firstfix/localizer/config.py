"""The settings of a localizer, one tree."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from firstfix.amcl.config import AmclConfig
from firstfix.belief.config import BeliefConfig
from firstfix.core.arguments import as_instance
from firstfix.core.settings import check_settings, setting
from firstfix.global_localization.config import LocateConfig

# The smallest value of settings that must be positive.
_LEAST = 1e-3


@dataclass(frozen=True, slots=True)
class MonitorConfig:
    """When a pose is accepted, doubted and given up.

    Costs are those of `firstfix.global_localization.verify`: at true poses of real logs 97 % are
    below 1.6, at random poses 95 % are above 2.9 (docs/decisions/0011).

    Raises
    ------
    InputError
        If a setting is out of its range.

    Examples
    --------
    >>> config = ff.LocalizerConfig(monitor=ff.MonitorConfig(lost_after_s=5.0))
    """

    doubtful_cost: float = setting(
        1.7, "mean cost of a beam above which the tracked pose is doubted, nats", _LEAST, 100.0
    )
    contradiction_cost: float = setting(
        2.3, "mean cost above which a scan contradicts the tracked pose, nats", _LEAST, 100.0
    )
    lost_after_s: float = setting(
        2.0, "uninterrupted contradiction after which the pose is given up, s", _LEAST, 3600.0
    )
    search_period_s: float = setting(
        0.2, "least time between two searches of the whole map while tracking, s", _LEAST, 3600.0
    )
    confirmations: int = setting(
        2, "consecutive scans that must agree on another place to move there", 1, 100
    )
    rest_period_s: float = setting(
        1.0, "time between searches while a robot that is not found rests, s", _LEAST, 3600.0
    )
    correct_m: float = setting(
        0.15, "position error that is corrected although the scan still fits, m", _LEAST, 100.0
    )
    correct_rad: float = setting(
        math.radians(5.0), "heading error that is corrected likewise, rad", _LEAST, math.pi
    )
    decided_cost: float = setting(
        1.3, "highest mean cost at which a track is moved to another place, nats", _LEAST, 100.0
    )
    decided_views: int = setting(
        3, "views that a place far from where the pose was lost needs", 1, 100
    )

    def __post_init__(self) -> None:
        check_settings(self)


@dataclass(frozen=True, slots=True)
class ScansConfig:
    """What is done to scans before they are used.

    Raises
    ------
    InputError
        If a setting has the wrong type.

    Examples
    --------
    >>> config = ff.LocalizerConfig(scans=ff.ScansConfig(deskew=False))
    """

    deskew: bool = setting(
        True,
        "straighten the scans of a moving robot by its odometry, where they have time_increment or "
        "scan_time",
    )

    def __post_init__(self) -> None:
        check_settings(self)


@dataclass(frozen=True, slots=True)
class ChangesConfig:
    """What is kept about changes of the map.

    Raises
    ------
    InputError
        If a setting is out of its range.

    Examples
    --------
    >>> config = ff.LocalizerConfig(changes=ff.ChangesConfig(days_kept=7))
    """

    days_kept: int = setting(
        0,
        "days for which hits and passes of beams are counted, to report what has changed in the "
        "map; 6 bytes per cell and day; 0 for none",
        0,
        366,
    )

    def __post_init__(self) -> None:
        check_settings(self)


@dataclass(frozen=True, slots=True)
class LocalizerConfig:
    """The settings of a `Localizer`.

    Parameters
    ----------
    locate : LocateConfig
        Global localization.
    amcl : AmclConfig
        Pose tracking.
    monitor : MonitorConfig
        Verification of the tracked pose.
    belief : BeliefConfig
        The choice between several places.
    scans : ScansConfig
        What is done to scans first.
    changes : ChangesConfig
        What is kept about changes of the map.

    Examples
    --------
    >>> config = ff.LocalizerConfig(amcl=ff.AmclConfig(max_particles=500))
    >>> ff.Localizer(config).config.amcl.max_particles
    500
    """

    locate: LocateConfig = field(default_factory=LocateConfig)
    amcl: AmclConfig = field(default_factory=AmclConfig)
    monitor: MonitorConfig = field(default_factory=MonitorConfig)
    belief: BeliefConfig = field(default_factory=BeliefConfig)
    scans: ScansConfig = field(default_factory=ScansConfig)
    changes: ChangesConfig = field(default_factory=ChangesConfig)

    def __post_init__(self) -> None:
        as_instance(LocateConfig, self.locate, "locate")
        as_instance(AmclConfig, self.amcl, "amcl")
        as_instance(MonitorConfig, self.monitor, "monitor")
        as_instance(BeliefConfig, self.belief, "belief")
        as_instance(ScansConfig, self.scans, "scans")
        as_instance(ChangesConfig, self.changes, "changes")
