"""All settings of the system, one tree."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from firstfix.amcl.config import AmclConfig
from firstfix.core.arguments import as_instance
from firstfix.core.errors import InputError
from firstfix.global_localization.config import LocateConfig


@dataclass(frozen=True, slots=True)
class WatchConfig:
    """When a pose is believed, doubted and given up.

    Costs are those of `firstfix.global_localization.verify`: at true poses of real logs 97 % are
    below 1.6, at random poses 95 % are above 2.9 (docs/decisions/0011).

    Parameters
    ----------
    doubtful_cost : float
        Mean cost of a beam from which on a tracked pose is doubted, nats.
    impossible_cost : float
        Mean cost from which on a scan contradicts the tracked pose, nats.
    lost_after_s : float
        Time of uninterrupted contradiction after which the pose is given up, s.
    search_period_s : float
        Least time between two searches of the whole map beside tracking, s.
    confirmations : int
        Scans in a row that must agree on another place before the track goes there.
    agree_m, agree_rad : float
        Up to where two poses are one place.
    look_again_m, look_again_rad : float
        Motion after which a further scan brings news about an ambiguous place.
    look_again_s : float
        Time after which a robot at rest is looked at again: people and hands go, s.
    off_m, off_rad : float
        Error of a track that is put right although the scan still fits.
    won_probability : float
        Probability that a place must have to win without a UNIQUE scan.
    won_cost : float
        Mean cost up to which a place may win, or a track may move to it: what is found by search
        must fit better than what is only not contradicted.
    won_looks : int
        Looks that this takes at least; and looks in a row at which not even the best place fits,
        after which all are given up.

    Raises
    ------
    InputError
        If a setting is not positive.
    """

    doubtful_cost: float = 1.7
    impossible_cost: float = 2.3
    lost_after_s: float = 2.0
    search_period_s: float = 0.2
    confirmations: int = 2
    agree_m: float = 0.5
    agree_rad: float = math.radians(15.0)
    look_again_m: float = 0.5
    look_again_rad: float = math.radians(30.0)
    look_again_s: float = 1.0
    off_m: float = 0.15
    off_rad: float = math.radians(5.0)
    won_probability: float = 0.99
    won_cost: float = 1.3
    won_looks: int = 3

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise InputError(
                    expected=f"{name} above 0",
                    received=f"{value}",
                    remedy="leave it at its default if in doubt",
                )


@dataclass(frozen=True, slots=True)
class LocalizerConfig:
    """The settings of a `Localizer`.

    Parameters
    ----------
    locate : LocateConfig
        Of the static stage.
    amcl : AmclConfig
        Of the dynamic stage.
    watch : WatchConfig
        Of what decides between them.
    """

    locate: LocateConfig = field(default_factory=LocateConfig)
    amcl: AmclConfig = field(default_factory=AmclConfig)
    watch: WatchConfig = field(default_factory=WatchConfig)

    def __post_init__(self) -> None:
        as_instance(LocateConfig, self.locate, "locate")
        as_instance(AmclConfig, self.amcl, "amcl")
        as_instance(WatchConfig, self.watch, "watch")
