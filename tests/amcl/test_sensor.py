"""From the likelihoods of beams to that of a scan."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from firstfix.amcl.beam_selection import SelectedBeams, select_beams
from firstfix.amcl.config import AmclConfig, SensorModel
from firstfix.amcl.likelihood_field import LikelihoodField
from firstfix.amcl.particles import Particles, equal_weights
from firstfix.amcl.ray_model import RayModel
from firstfix.amcl.sensor import EFFECTIVE_BEAMS, build_sensor, weigh
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.lab.simulation.lidar import Lidar


class Told:
    """A sensor with given log-likelihoods."""

    def __init__(self, logs: list[float], used: int) -> None:
        self.logs, self.used = np.array(logs), used

    def log_likelihood(
        self, particles: Particles, beams: SelectedBeams
    ) -> tuple[NDArray[np.float64], int]:
        return self.logs, self.used


def beams_of(n: int) -> SelectedBeams:
    scan = LaserScan(np.full(n, 2.0, np.float32), -1.0, 0.01, 0.1, 8.0)
    return select_beams(scan, AmclConfig(max_beams=1000))


def three() -> Particles:
    return equal_weights(np.zeros((3, 3))).reweighed(np.array([1.0, 1.0, 2.0]))


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        (SensorModel.LIKELIHOOD_FIELD, LikelihoodField),
        (SensorModel.LIKELIHOOD_FIELD_PROB, LikelihoodField),
        (SensorModel.BEAM, RayModel),
    ],
)
def test_the_model_is_that_of_the_settings(room, model, kind):
    config = AmclConfig(laser_model_type=model)
    sensor = build_sensor(room, config)
    assert type(sensor) is kind
    assert sensor.grid is room
    assert sensor.config is config


@pytest.mark.parametrize("n", [1, 5, EFFECTIVE_BEAMS])
def test_few_beams_are_independent(n):
    logs = [-3.0, -1.0, -2.5]
    likelihood, _ = weigh(three(), [beams_of(n)], Told(logs, n))
    np.testing.assert_allclose(likelihood, np.exp(np.array(logs) + 1.0))


@pytest.mark.parametrize("times", [2, 3, 10])
def test_the_same_beams_many_times_over_are_not_many_times_as_sure(times):
    n = 2 * EFFECTIVE_BEAMS
    logs = np.array([-3.0, -1.0, -2.5]) * n
    once, fit = weigh(three(), [beams_of(n)], Told(list(logs), n))
    often, fits = weigh(three(), [beams_of(times * n)], Told(list(times * logs), times * n))
    np.testing.assert_allclose(often, once)
    assert fits == pytest.approx(fit)


def test_the_best_particle_has_likelihood_one_and_none_overflows():
    for best in (-1e6, -5000.0, 0.0, 300.0):
        likelihood, _ = weigh(three(), [beams_of(60)], Told([best - 1e5, best, best - 4.0], 60))
        np.testing.assert_allclose(
            likelihood, [0.0, 1.0, math.exp(-4.0 * EFFECTIVE_BEAMS / 60)], atol=1e-300
        )


def test_fit_is_the_geometric_mean_over_the_belief():
    logs = [40 * math.log(0.1), 40 * math.log(0.2), 40 * math.log(0.4)]
    _, fit = weigh(three(), [beams_of(60)], Told(logs, 40))
    assert fit == pytest.approx((0.1 * 0.2 * 0.4 * 0.4) ** 0.25)


def test_an_uninformative_scan_leaves_all_equally_likely():
    likelihood, fit = weigh(three(), [beams_of(60)], Told([0.0, 0.0, 0.0], 0))
    assert likelihood.tolist() == [1.0, 1.0, 1.0]
    assert math.isnan(fit)


@pytest.mark.parametrize("model", SensorModel)
def test_the_place_of_the_sensor_is_found_where_it_is(room, model):
    """Of poses that differ by where the sensor would be, the true one explains the scan best."""
    config = AmclConfig(laser_model_type=model)
    truth = SE2(4.1, 2.7, 0.6)
    lidar = Lidar(beams=60, sigma_m=0.0, T_base_laser=SE2(0.5, 0.2, 1.0))
    beams = select_beams(lidar.scan(room, truth, np.random.default_rng(0)), config)
    around = [truth.as_array() + d for d in np.eye(3) * 0.3] + [
        truth.as_array() - d for d in np.eye(3) * 0.3
    ]
    likelihood, fit = weigh(
        equal_weights(np.array([truth.as_array(), *around])), [beams], build_sensor(room, config)
    )
    assert likelihood[0] == 1.0
    assert likelihood[1:].max() < 0.5
    assert 0.01 < fit < 1.0
