"""When the last seconds are saved, and what happens on a disk that refuses."""

from __future__ import annotations

import numpy as np
import pytest

from firstfix.core.errors import InputError
from firstfix.core.odometry import Odometry
from firstfix.core.se2 import SE2
from firstfix.io.incident_files import IncidentFolder, load_incident
from firstfix.lab.simulation.lidar import Lidar
from firstfix.localizer.incident import Cause
from firstfix.localizer.incident_document import from_document
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.localizer import Localizer
from firstfix.ros.incident_keeper import IncidentKeeper
from firstfix.ros.node import Node
from firstfix.ros.node_config import NodeConfig
from firstfix.ros.services import Request

OFF_THE_MAP = SE2(500.0, 0.0, 0.0)


@pytest.fixture
def warnings() -> list[str]:
    return []


def keeper_in(folder, warnings, seconds=3.0) -> IncidentKeeper:
    return IncidentKeeper(seconds, IncidentFolder(folder), warnings.append)


def watch(keeper: IncidentKeeper, *inputs) -> Localizer:
    localizer = Localizer()
    for given in inputs:
        keeper(given, localizer.handle(given), localizer)
    return localizer


def test_a_refused_hint_is_saved(tmp_path, hall_plan, warnings):
    keeper = keeper_in(tmp_path, warnings)
    scan = Lidar(beams=90).scan(hall_plan, SE2(4.0, 3.0, 1.0), np.random.default_rng(1), 1.0)
    odometry = Odometry(1.0, SE2.identity())
    watch(keeper, NewMap(0.0, hall_plan), odometry, scan, PoseHint(1.1, OFF_THE_MAP))
    keeper.close()
    (file,) = keeper.folder.files()
    assert file.cause == "refused hint"
    incident = from_document(*load_incident(tmp_path / file.name)).incident
    assert incident.cause is Cause.REFUSED_HINT
    assert "refused" in incident.reason
    assert incident.inputs[-1].T_map_base == OFF_THE_MAP
    assert warnings == []


def test_one_cause_is_not_saved_again_and_again(tmp_path, hall_plan, warnings):
    keeper = keeper_in(tmp_path, warnings)
    hints = [PoseHint(stamp, OFF_THE_MAP) for stamp in (1.0, 1.5, 2.0, 3.9)]
    watch(keeper, NewMap(0.0, hall_plan), *hints)
    keeper.close()
    assert len(keeper.folder.files()) == 1


def test_a_disk_that_refuses_is_a_warning(tmp_path, hall_plan, warnings):
    (tmp_path / "file").write_text("")
    keeper = keeper_in(tmp_path / "file" / "folder", warnings)
    localizer = watch(keeper, NewMap(0.0, hall_plan), PoseHint(1.0, OFF_THE_MAP))
    keeper.close()
    assert len(warnings) == 1
    assert "the incident is not saved" in warnings[0]
    assert localizer.matcher is not None
    with pytest.raises(InputError, match="access"):
        keeper.save()


def test_nothing_is_kept_before_a_map_or_with_no_seconds(tmp_path, hall_plan, warnings):
    with pytest.raises(InputError, match="first map"):
        keeper_in(tmp_path, warnings).save()
    off = keeper_in(tmp_path, warnings, seconds=0.0)
    watch(off, NewMap(0.0, hall_plan), PoseHint(1.0, OFF_THE_MAP))
    with pytest.raises(InputError, match="incident_seconds is 0"):
        off.save()
    off.close()
    assert off.folder.files() == []


def test_the_service_answers_with_the_path(tmp_path, ros2, hall_plan):
    from recorder import Recorder

    node = Node(NodeConfig(incident_folder=str(tmp_path)), Recorder(ros2))
    refused = node.answer(Request.SAVE_INCIDENT, None)
    assert refused["success"] is False
    node._handle(NewMap(0.0, hall_plan))
    answered = node.answer(Request.SAVE_INCIDENT, None)
    assert answered["success"] is True
    assert load_incident(answered["message"])[0]["cause"] == "requested"
