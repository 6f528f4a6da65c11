"""Settings: one declaration, checked types and ranges, and errors with a remedy."""

import math
from dataclasses import FrozenInstanceError, dataclass, field, fields
from enum import Enum

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.core.settings import check_settings, setting


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True, slots=True)
class Lamp:
    power: float = setting(5.0, "light, W", 0.0, 100.0)
    count: int = setting(2, "bulbs", 1)
    is_on: bool = setting(False, "burning")
    colour: Colour = setting(Colour.RED, "of the light")  # noqa: RUF009 - frozen
    name: str = setting("lamp", "on the label")
    note: str = setting("", "anything, or nothing")
    shift: float = setting(0.0, "either way, m")
    place: SE2 = setting(SE2.identity(), "in the room")  # noqa: RUF009 - frozen
    unchecked: object = field(default=None)

    def __post_init__(self) -> None:
        check_settings(self)


def test_defaults_are_as_declared():
    assert Lamp() == Lamp(5.0, 2, False, Colour.RED, "lamp", "", 0.0, SE2.identity())


def test_a_setting_has_a_description_and_a_range():
    power = fields(Lamp)[0].metadata
    assert (power["description"], power["least"], power["most"]) == ("light, W", 0.0, 100.0)
    free = fields(Lamp)[6].metadata
    assert (free["least"], free["most"]) == (-math.inf, math.inf)


def test_settings_are_frozen():
    with pytest.raises(FrozenInstanceError):
        Lamp().power = 3.0


def test_a_whole_number_becomes_a_float():
    lamp = Lamp(power=7)
    assert lamp.power == 7.0
    assert type(lamp.power) is float


@pytest.mark.parametrize(
    "good", [{"power": 0.0}, {"power": 100.0}, {"count": 1}, {"count": 2**53}, {"shift": -1e9}]
)
def test_both_ends_of_a_range_are_accepted(good):
    lamp = Lamp(**good)
    assert all(getattr(lamp, name) == value for name, value in good.items())


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"power": -0.1}, r"power \(light, W\) as a number of at least 0 and at most 100"),
        ({"power": 100.1}, "received 100.1; the default is 5.0"),
        ({"power": math.nan}, "received nan"),
        ({"power": True}, "received True"),
        ({"power": "5"}, "received '5'"),
        ({"power": None}, "received None"),
        ({"count": 0}, "count .bulbs. as a whole number of at least 1, received 0"),
        ({"count": 2.0}, "received 2.0"),
        ({"count": True}, "received True"),
        ({"count": 2**53 + 1}, "a whole number"),
        ({"shift": math.inf}, "received inf"),
        ({"shift": -math.inf}, "received -inf"),
        ({"shift": -(2.0**54)}, "a number"),
        ({"shift": 10**400}, "a number"),
        ({"is_on": 1}, "true or false"),
        ({"is_on": "true"}, "true or false"),
        ({"colour": "green"}, "colour as one of red, blue, received 'green'"),
        ({"name": ""}, "name .on the label. as a text, received ''"),
        ({"name": 5}, "a text"),
        ({"note": None}, "a text"),
        ({"place": (0.0, 0.0)}, "metres and radians"),
    ],
)
def test_invalid_values_are_refused_with_a_remedy(bad, words):
    with pytest.raises(InputError, match=words):
        Lamp(**bad)


def test_an_empty_text_is_accepted_if_the_default_is_empty():
    assert Lamp(note="").note == ""


def test_fields_that_are_no_settings_are_not_checked():
    assert Lamp(unchecked=[1]).unchecked == [1]


def test_a_long_value_is_shortened_in_the_message():
    with pytest.raises(InputError) as caught:
        Lamp(power="x" * 10_000)
    assert len(str(caught.value)) < 300


ANYTHING = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.lists(st.integers(), max_size=2)
    | st.sampled_from([*Colour, SE2.identity()])
)


@given(st.sampled_from([entry.name for entry in fields(Lamp)][:-1]), ANYTHING)
def test_a_setting_has_the_type_of_its_default_or_is_refused(name, value):
    try:
        lamp = Lamp(**{name: value})
    except InputError:
        return
    assert type(getattr(lamp, name)) is type(getattr(Lamp(), name))
    if isinstance(value, float):
        assert math.isfinite(getattr(lamp, name))
