"""What robots ask."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fleet_lab import as_message, scan_of

from firstfix.core.errors import InputError
from firstfix.core.se2 import SE2
from firstfix.fleet.messages import read_query, read_robot_view
from firstfix.io.maps.site_yaml import SiteMap
from firstfix.site.query import SitePrior
from firstfix.site.zones import zone_prior
from firstfix.web.request_body import JSON

HALL = ((0.0, 0.0), (5.0, 0.0), (5.0, 4.0))


def zones(name: str) -> SitePrior:
    return zone_prior([SiteMap("first", Path("first.yaml"), zones={"hall": HALL})], name)


def test_a_zone_is_a_prior() -> None:
    asked = {"scans": [as_message(scan_of("first", SE2(2.3, 2.1, 0.0)))], "zone": "hall"}
    query = read_query(json.dumps(asked).encode(), JSON, None, zones).query
    _, prior = read_robot_view(json.dumps({**asked, "odometry": [0, 0, 0]}).encode(), zones)
    for found in (query.prior, prior):
        assert found is not None
        assert list(found) == ["first"]
        assert getattr(found["first"], "polygon", None) == HALL
    for wrong, sentence in (
        ({"zone": "attic"}, "There is no zone 'attic' in this site. Choose one of hall."),
        ({"prior": {"first": None}}, "Give either a zone or a prior of maps."),
    ):
        with pytest.raises(InputError, match=sentence):
            read_query(json.dumps({**asked, **wrong}).encode(), JSON, None, zones)
