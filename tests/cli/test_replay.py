"""``firstfix replay``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.incident_files import load_incident, packed
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.incident import Cause, IncidentRecorder
from firstfix.localizer.incident_document import to_document
from firstfix.localizer.inputs import NewMap
from firstfix.localizer.localizer import Localizer


@pytest.fixture(scope="module")
def incident(hall_plan, tmp_path_factory) -> Path:
    recorder, localizer, rng = IncidentRecorder(30.0), Localizer(), np.random.default_rng(1)
    inputs = [NewMap(0.0, hall_plan)]
    for i in range(4):
        pose = SE2(4.0, 3.0, 1.0) @ SE2(0.1 * i, 0.0, 0.0)
        inputs.append(Odometry(1.0 + i, SE2(0.1 * i, 0.0, 0.0)))
        inputs.append(Lidar(beams=90).scan(hall_plan, pose, rng, 1.0 + i))
    for given in inputs:
        recorder.observe(given, localizer.handle(given), localizer)
    taken = recorder.take(Cause.LOST_POSE, "only 12% of the beams fit here")
    assert taken is not None
    path = tmp_path_factory.mktemp("incident") / "incident.npz"
    path.write_bytes(packed(*to_document(taken)))
    return path


def test_it_says_what_happened_and_that_it_is_the_same(cli, incident):
    ended = cli("replay", incident, "--check")
    assert ended.status == 0, ended
    assert ended.out.startswith("lost pose: only 12% of the beams fit here\n3.0 s, 8 inputs, ")
    assert "LOCALIZED" in ended.out
    assert "identical to the last bit" in ended.out


def test_json_is_one_object(cli, incident):
    document = json.loads(cli("replay", incident, "--json").out)
    assert (document["cause"], document["inputs"], document["identical"]) == ("lost pose", 8, True)
    assert document["changes"][-1]["state"] == "LOCALIZED"


def test_another_output_is_status_1(cli, incident, tmp_path):
    document, arrays = load_incident(incident)
    arrays["arrays"] = arrays["arrays"].copy()
    arrays["arrays"][-1] ^= 1
    document["software"]["numpy"] = "0.1"
    (tmp_path / "other.npz").write_bytes(packed(document, arrays))
    ended = cli("replay", "other.npz", "--check")
    assert ended.status == 1
    assert "outputs differ from stamp" in ended.out
    assert "numpy 0.1 then" in ended.out
    assert cli("replay", "other.npz").status == 0


def test_a_file_that_is_none_is_status_2(cli, tmp_path, incident):
    (tmp_path / "x.npz").write_bytes(incident.read_bytes()[:-30])
    for name in ("x.npz", "missing.npz"):
        ended = cli("replay", name)
        assert ended.status == 2
        assert ended.out == ""
        assert ended.err.count("\n") == 1
