"""Settings of the filter: names, units and defaults of Nav2's AMCL."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firstfix.core.errors import InputError
from firstfix.core.settings import check_settings, setting


class MotionModel(Enum):
    """How the base moves; the values are Nav2's plugin names.

    Examples
    --------
    >>> ff.AmclConfig(robot_model_type="stationary").robot_model_type
    <MotionModel.STATIONARY: 'stationary'>
    """

    DIFFERENTIAL = "nav2_amcl::DifferentialMotionModel"
    OMNIDIRECTIONAL = "nav2_amcl::OmniMotionModel"
    STATIONARY = "stationary"


class SensorModel(Enum):
    """How a scan weighs a particle; the values are Nav2's.

    Examples
    --------
    >>> ff.AmclConfig(laser_model_type="beam").laser_model_type
    <SensorModel.BEAM: 'beam'>
    """

    LIKELIHOOD_FIELD = "likelihood_field"
    LIKELIHOOD_FIELD_PROB = "likelihood_field_prob"
    BEAM = "beam"


@dataclass(frozen=True, slots=True)
class AmclConfig:
    """All settings of the filter; the metadata of each field has its description and range.

    Names and defaults are those of Nav2's AMCL. Its topics, frames and rates are parameters of the
    node (`firstfix.ros.node_config`). `model_unknown_space` is Beluga's,
    `selective_resampling` that of AMCL for ROS 1.

    Raises
    ------
    InputError
        If a setting has the wrong type or is out of its range, or two contradict each other.

    Examples
    --------
    >>> config = ff.AmclConfig(laser_model_type="beam", max_beams=30)
    >>> config.laser_model_type
    <SensorModel.BEAM: 'beam'>
    """

    alpha1: float = setting(0.2, "rotation noise from rotation", 0.0)
    alpha2: float = setting(0.2, "rotation noise from translation", 0.0)
    alpha3: float = setting(0.2, "translation noise from translation", 0.0)
    alpha4: float = setting(0.2, "translation noise from rotation", 0.0)
    alpha5: float = setting(0.2, "sideways noise from translation (omnidirectional)", 0.0)
    robot_model_type: MotionModel = setting(MotionModel.DIFFERENTIAL, "how the base moves")

    laser_model_type: SensorModel = setting(
        SensorModel.LIKELIHOOD_FIELD, "how a scan weighs a particle"
    )
    max_beams: int = setting(60, "beams of a scan used, evenly spaced", 2, 20_000)
    laser_min_range: float = setting(-1.0, "shortest range used, m; -1: the sensor's own", -1.0)
    laser_max_range: float = setting(100.0, "longest range used, m; -1: the sensor's own", -1.0)
    laser_likelihood_max_dist: float = setting(
        2.0, "distance from a wall at which the likelihood field saturates, m", 0.01
    )
    z_hit: float = setting(0.5, "weight of a hit in the mixture", 0.0, 1.0)
    z_short: float = setting(0.05, "weight of an unexpected obstacle (beam)", 0.0, 1.0)
    z_max: float = setting(0.05, "weight of a missing return (beam)", 0.0, 1.0)
    z_rand: float = setting(0.5, "weight of a random reading", 1e-6, 1.0)
    sigma_hit: float = setting(0.2, "spread of a hit, m", 1e-3)
    lambda_short: float = setting(0.1, "decay of unexpected obstacles (beam), 1/m", 1e-6)
    do_beamskip: bool = setting(
        False, "leave out beams that most particles do not explain (likelihood_field_prob)"
    )
    beam_skip_distance: float = setting(
        0.5, "distance from a wall up to which an end point is explained, m", 0.0
    )
    beam_skip_threshold: float = setting(
        0.3, "share of particles that must explain a beam for it to count", 0.0, 1.0
    )
    beam_skip_error_threshold: float = setting(
        0.9, "if more than this fraction would be skipped, skip none", 0.0, 1.0
    )
    model_unknown_space: bool = setting(
        False, "treat end points in unknown space as uninformative (1 / range_max)"
    )

    min_particles: int = setting(500, "least number of particles", 1, 10_000_000)
    max_particles: int = setting(2000, "greatest number of particles", 1, 10_000_000)
    pf_err: float = setting(0.05, "KLD: greatest error of the distribution", 1e-6, 1.0)
    pf_z: float = setting(
        0.99, "KLD: upper standard normal quantile of the probability of a smaller error", 0.0, 10.0
    )
    resample_interval: int = setting(1, "updates from one resampling to the next", 1)
    selective_resampling: bool = setting(
        False, "resample only when the effective sample size is below half of the particles"
    )
    recovery_alpha_slow: float = setting(
        0.0, "decay of the slow average weight; 0: no new particles (0.001 is a good start)", 0, 1
    )
    recovery_alpha_fast: float = setting(
        0.0, "decay of the fast average weight; 0: no new particles (0.1 is a good start)", 0, 1
    )
    update_min_d: float = setting(0.25, "translation before an update, m", 0.0)
    update_min_a: float = setting(0.2, "rotation before an update, rad", 0.0)
    random_seed: int = setting(-1, "seed of all randomness; negative: 0, so that runs repeat", -1)

    @property
    def seed(self) -> int:
        """Seed of all randomness: random_seed, or 0 where that is negative."""
        return max(0, self.random_seed)

    def __post_init__(self) -> None:
        check_settings(self)
        if self.min_particles > self.max_particles:
            raise InputError(
                expected="min_particles up to max_particles",
                received=f"{self.min_particles} and {self.max_particles}",
                remedy="raise max_particles or lower min_particles",
            )
