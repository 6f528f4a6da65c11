"""Options of ``locate`` that say where the robot may be."""

import json
from pathlib import Path

import pytest

from firstfix.belief.prior import All, AnyOf, Near, Region
from firstfix.cli.prior_options import prior_of
from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2

NOWHERE = Path("map.yaml")


def test_options_are_priors() -> None:
    assert prior_of(NOWHERE, None, None, None) is None
    assert prior_of(NOWHERE, ["1,2"], 3.0, None) == Near(SE2(1.0, 2.0, 0.0), 3.0)
    heading = prior_of(NOWHERE, ["1,2,0.5"], None, None)
    assert isinstance(heading, Near)
    assert (heading.pose, heading.radius) == (SE2(1.0, 2.0, 0.5), 1.0)
    assert heading.angle < 1.0
    assert isinstance(prior_of(NOWHERE, ["1,2", "3,4"], None, None), AnyOf)
    assert isinstance(prior_of(NOWHERE, None, None, "0,0 1,0 1,1"), Region)
    assert isinstance(prior_of(NOWHERE, ["1,2"], None, "0,0 1,0 1,1"), All)


@pytest.mark.parametrize(
    ("near", "radius", "region", "words"),
    [
        (["1"], None, None, "--near 1 cannot be read"),
        (["1,x"], None, None, "--near 1,x cannot"),
        (["nan,0"], None, None, "cannot be read"),
        (None, 2.0, None, "Add --near"),
        (["1,2"], -1.0, None, "radius"),
        (None, None, "0,0 1,1", "three corners"),
        (None, None, "0,0 1,1,1 2,2", "--region 1,1,1 cannot"),
    ],
)
def test_other_text_is_refused(near, radius, region, words) -> None:
    with pytest.raises(InputError, match=words):
        prior_of(NOWHERE, near, radius, region)


def test_a_prior_ranks_two_equal_rooms_and_does_not_decide(cli, alike: tuple[Path, Path]) -> None:
    first = json.loads(cli("locate", *alike, "--json").out)
    for place in first["hypotheses"][:2]:
        x, y, _ = place["pose"]
        ended = cli("locate", *alike, "--json", "--near", f"{x:.1f},{y:.1f}", "--radius", 2)
        assert ended.status == 1  # a wrong prior would look the same
        answer = json.loads(ended.out)
        assert answer["verdict"] == "AMBIGUOUS"
        assert answer["pose"][0] == pytest.approx(x, abs=0.1)
        assert answer["probability_without_prior"] < 0.6


def test_a_zone_beside_the_map_is_a_prior(cli, alike: tuple[Path, Path]) -> None:
    zones = alike[0].with_suffix(".zones.yaml")
    x, y, _ = json.loads(cli("locate", *alike, "--json").out)["pose"]
    zones.write_text(f"zones: {{here: [[{x - 1}, {y - 1}], [{x + 1}, {y - 1}], [{x}, {y + 1}]]}}")
    try:
        answer = json.loads(cli("locate", *alike, "--json", "--region", "here").out)
        assert answer["pose"][:2] == pytest.approx([x, y], abs=0.1)
        ended = cli("locate", *alike, "--region", "there")
        assert (ended.status, ended.err) == (
            2, "firstfix: There is no zone there. Choose one of here.\n"
        )  # fmt: skip
        zones.write_text("zones: {here: [[1, 2]]}")
        ended = cli("locate", *alike, "--region", "here")
        assert ended.status == 2
        assert "The zone here in" in ended.err
    finally:
        zones.unlink()
    assert "zones" in cli("locate", *alike, "--region", "here").err
