"""The node and a peer with Fast DDS find each other: a second vendor, with Humble's rules."""

import shutil
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")

from dds_lab import wait_for
from required import missing

from firstfix.ros.dds.graph import GRAPH

SOURCE = Path(__file__).parents[2] / "robots" / "fastdds_peer.cpp"
HEADER = Path("/usr/include/fastdds/dds/domain/DomainParticipant.hpp")
TYPE = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"


@pytest.fixture(scope="module")
def peer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("g++")
    if not HEADER.is_file() or compiler is None:
        missing("fastdds", "no Fast DDS: apt-get install g++ libfastrtps-dev")
    program = tmp_path_factory.mktemp("fastdds") / "peer"
    libraries = ["-lfastrtps", "-lfastcdr"]
    subprocess.run([compiler, "-std=c++17", "-o", program, SOURCE, *libraries], check=True)
    return program


@pytest.mark.slow
@pytest.mark.parametrize("order", ["the robot first", "the robot last"])
@pytest.mark.parametrize("reach", ["localhost", "network"])
def test_the_entry_of_the_node_in_the_graph_arrives(dds, peer, reach, order):
    arguments = [peer, str(dds.domain), GRAPH.name, TYPE, reach]
    environment = {"ROS_DISTRO": "humble", "CYCLONEDDS_URI": ""}
    if reach == "localhost":
        environment["ROS_LOCALHOST_ONLY"] = "1"
    if order == "the robot first":
        robot = subprocess.Popen(arguments)
        time.sleep(2.0)
        dds.node(**environment)
    else:
        node = dds.node(**environment)
        wait_for(lambda: "no message on" in node.log)
        robot = subprocess.Popen(arguments)
    try:
        assert robot.wait(240.0) == 0
    finally:
        robot.kill()
        robot.wait()
