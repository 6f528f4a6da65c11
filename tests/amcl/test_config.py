"""Settings: Nav2's names and defaults, and an error for what cannot be."""

from __future__ import annotations

import math
from dataclasses import fields

import pytest

from firstfix.amcl.config import AmclConfig, MotionModel, SensorModel
from firstfix.core.errors import InputError

# nav2_amcl, the defaults that its documentation and its code give.
NAV2 = {
    "alpha1": 0.2,
    "alpha2": 0.2,
    "alpha3": 0.2,
    "alpha4": 0.2,
    "alpha5": 0.2,
    "beam_skip_distance": 0.5,
    "beam_skip_error_threshold": 0.9,
    "beam_skip_threshold": 0.3,
    "do_beamskip": False,
    "lambda_short": 0.1,
    "laser_likelihood_max_dist": 2.0,
    "laser_max_range": 100.0,
    "laser_min_range": -1.0,
    "laser_model_type": SensorModel("likelihood_field"),
    "max_beams": 60,
    "max_particles": 2000,
    "min_particles": 500,
    "pf_err": 0.05,
    "pf_z": 0.99,
    "random_seed": -1,
    "recovery_alpha_fast": 0.0,
    "recovery_alpha_slow": 0.0,
    "resample_interval": 1,
    "robot_model_type": MotionModel("nav2_amcl::DifferentialMotionModel"),
    "sigma_hit": 0.2,
    "update_min_a": 0.2,
    "update_min_d": 0.25,
    "z_hit": 0.5,
    "z_max": 0.05,
    "z_rand": 0.5,
    "z_short": 0.05,
}
OURS = {"model_unknown_space": False, "selective_resampling": False}
ENTRIES = fields(AmclConfig)


def kind_of(entry) -> type:
    return type(entry.default)


def test_names_and_defaults_are_those_of_nav2():
    config = AmclConfig()
    assert {entry.name: getattr(config, entry.name) for entry in ENTRIES} == NAV2 | OURS


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_setting_has_a_description(entry):
    assert len(entry.metadata["description"]) > 10
    assert entry.metadata["least"] <= entry.metadata["most"]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_the_limits_of_a_range_are_in_it_and_what_is_beyond_is_not(entry):
    least, most = entry.metadata["least"], entry.metadata["most"]
    step = 1 if kind_of(entry) is int else 1e-9
    for limit, outside in ((least, least - step), (most, most + step)):
        if math.isfinite(limit):
            others = {"min_particles": 1, "max_particles": 10_000_000}
            inside = {entry.name: kind_of(entry)(limit)}
            assert getattr(AmclConfig(**(others | inside)), entry.name) == limit
            with pytest.raises(InputError, match=entry.name):
                AmclConfig(**(others | {entry.name: kind_of(entry)(outside)}))


def fits(wrong: object, kind: type) -> bool:
    number = type(wrong) in (float, int) and math.isfinite(wrong)
    return (kind is float and number) or (type(wrong) is kind and (kind is not float))


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        (entry.name, wrong)
        for entry in ENTRIES
        for wrong in ("0.5", True, None, (), 1.5, math.nan, -math.inf, math.inf, b"map")
        if not fits(wrong, kind_of(entry))
    ],
    ids=repr,
)
def test_a_wrong_type_or_no_number_is_an_error(name, wrong):
    with pytest.raises(InputError, match=name):
        AmclConfig(**{name: wrong})


def test_a_whole_number_is_a_number():
    far = AmclConfig(update_min_d=1).update_min_d
    assert (far, type(far)) == (1.0, float)
    for enormous in (10**400, 2.0**60):
        with pytest.raises(InputError, match="update_min_d"):
            AmclConfig(update_min_d=enormous)


def test_an_error_names_the_range_and_the_default():
    with pytest.raises(InputError) as error:
        AmclConfig(z_hit=1.5)
    assert "at least 0 and at most 1" in error.value.expected
    assert error.value.received == "1.5"
    assert "0.5" in error.value.remedy


def test_the_least_number_of_particles_is_not_above_the_greatest():
    with pytest.raises(InputError, match="min_particles"):
        AmclConfig(min_particles=501, max_particles=500)
    assert AmclConfig(min_particles=500, max_particles=500).max_particles == 500
