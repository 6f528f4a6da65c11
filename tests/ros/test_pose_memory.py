"""The pose of a node before the first scan, and the pose kept for the next start."""

import threading

import numpy as np
import pytest
from recorder import Recorder, Speaker, wait_for

from firstfix.core.odometry import Odometry
from firstfix.core.scan import LaserScan
from firstfix.core.se2 import SE2
from firstfix.io.ros_messages.incoming import to_planar, to_pose
from firstfix.io.ros_messages.outgoing import pose_with_covariance
from firstfix.io.saved_pose import SavedPose, load_pose, map_key, save_pose
from firstfix.lab.worlds.catalog import identical_rooms
from firstfix.localizer.inputs import NewMap, PoseHint
from firstfix.localizer.outputs import Status, TrackedPose
from firstfix.localizer.states import State
from firstfix.ros.channels import AMCL_POSE, STATUS, Channel
from firstfix.ros.node import Node
from firstfix.ros.node_config import Mode, NodeConfig
from firstfix.ros.pose_memory import PoseKeeper, PoseMemory
from firstfix.ros.transport import Severity

THERE, DRIFT = SE2(4.0, 3.0, 1.0), SE2(1.0, -2.0, 0.5)
COUNTED, COUNTED_LATER = SE2(5.0, 5.0, 0.0), SE2(5.1, 5.0, 0.0)


@pytest.fixture
def file(tmp_path):
    return tmp_path / "pose.json"


@pytest.fixture
def lines():
    return []


@pytest.fixture
def memory_of(file, lines):
    """Give a function that makes the memory of a node; settings are those of AMCL."""
    made = []

    def memory_of(path=file, **parameters):
        config = NodeConfig(saved_pose_file=str(path), **parameters)
        made.append(PoseMemory(config, lambda severity, text: lines.append((severity, text))))
        return made[-1]

    yield memory_of
    for memory in made:
        memory.close()


def localized(stamp, T_map_base=THERE):
    pose = TrackedPose(stamp, T_map_base, 0.01 * np.eye(3), DRIFT)
    return [pose, Status(stamp, State.LOCALIZED, "it fits")]


def searching(stamp):
    return [Status(stamp, State.SEARCHING, "nothing fits")]


def saved(grid, stamp=100.0, T_map_base=THERE, T_odom_base=COUNTED):
    return SavedPose(T_map_base, 0.01 * np.eye(3), stamp, T_odom_base, map_key(grid))


# ---- keeping


def test_the_pose_is_kept_with_the_odometry_it_belongs_to(memory_of, hall_plan, file):
    memory = memory_of(save_pose_rate=1.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    memory.keep(localized(10.0))
    memory.keep(localized(10.5))
    memory.close()
    kept = load_pose(file)
    assert (kept.stamp, kept.map_key) == (10.5, map_key(hall_plan))
    assert kept.T_map_base == THERE
    assert (DRIFT @ kept.T_odom_base).distance_to(THERE) < 1e-9


def test_the_pose_is_kept_at_the_rate(memory_of, hall_plan, file):
    memory = memory_of(save_pose_rate=1.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    for i in range(20):
        memory.keep(localized(10.0 + 0.25 * i))
        if i == 4:
            wait_for(file.exists)
            assert load_pose(file).stamp == 11.0
    assert not memory._disk._shutdown


def test_an_invalid_pose_is_not_kept(memory_of, hall_plan, file):
    memory = memory_of(save_pose_rate=10.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    memory.keep(localized(10.0))
    memory.keep(localized(10.2))
    wait_for(file.exists)
    memory.keep(searching(10.3))
    wait_for(lambda: not file.exists())
    memory.keep(searching(10.4))
    memory.close()
    assert not file.exists()


def test_the_pose_of_an_earlier_run_stays_until_this_one_has_another(memory_of, hall_plan, file):
    save_pose(file, saved(hall_plan))
    memory = memory_of()
    memory.hint_after(NewMap(0.0, hall_plan))
    memory.keep(searching(10.0))
    memory.close()
    assert file.exists()


def test_without_a_file_nothing_is_kept(memory_of, tmp_path, hall_plan, monkeypatch):
    monkeypatch.chdir(tmp_path)
    memory = memory_of(path="", save_pose_rate=10.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    for i in range(5):
        memory.keep(localized(10.0 + i))
    memory.close()
    assert list(tmp_path.iterdir()) == []


def test_a_slow_disk_delays_no_scan(memory_of, hall_plan, monkeypatch):
    go_on, begun, written = threading.Event(), threading.Event(), []

    def save(keeper, pose):
        begun.set()
        go_on.wait(240.0)
        written.append(pose.stamp)

    monkeypatch.setattr(PoseKeeper, "save", save)
    memory = memory_of(save_pose_rate=1.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    for i in range(100):
        memory.keep(localized(10.0 + i))
    assert begun.wait(240.0)
    go_on.set()
    memory.close()
    assert written == [11.0, 109.0]  # none of those between has queued up


def test_a_disk_that_cannot_be_written_is_reported_once(memory_of, hall_plan, tmp_path, lines):
    memory = memory_of(path=tmp_path / "no" / "folder.json", save_pose_rate=1.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    lines.clear()
    for i in range(20):
        memory.keep(localized(10.0 + i))
        wait_for(lambda: memory._writing is None or memory._writing.done())
    memory.close()
    ((severity, text),) = lines
    assert severity is Severity.WARNING
    assert text.startswith("the pose is not saved: expected access to")


def test_a_disk_that_fails_again_after_it_worked_is_reported_again(
    memory_of, hall_plan, tmp_path, lines
):
    folder = tmp_path / "stick"
    memory = memory_of(path=folder / "pose.json", save_pose_rate=1.0)
    memory.hint_after(NewMap(0.0, hall_plan))
    lines.clear()
    for i in range(40):
        if i == 10:
            folder.mkdir()
        if i == 20:
            folder.rename(tmp_path / "gone")
        memory.keep(localized(10.0 + i))
        wait_for(lambda: memory._writing is None or memory._writing.done())
    assert len(lines) == 2


# ---- hints at the start


def at_start(memory, grid, stamp=200.0, T_odom_base=COUNTED_LATER):
    assert memory.hint_after(NewMap(0.0, grid)) is None
    return memory.hint_after(Odometry(stamp, T_odom_base))


def test_a_saved_pose_is_carried_on_by_odometry(memory_of, hall_plan, file, lines):
    save_pose(file, saved(hall_plan))
    hint = at_start(memory_of(), hall_plan)
    assert (hint.stamp, hint.source) == (200.0, "the saved pose")
    assert hint.T_map_base.distance_to(THERE @ SE2(0.1, 0.0, 0.0)) < 1e-9
    ((severity, text),) = lines
    assert severity is Severity.INFO
    assert text == (
        "the saved pose is moved along with odometry: saved 100 s ago; "
        "the robot has moved 0.10 m since by odometry"
    )


def test_a_saved_pose_is_a_hint_also_where_odometry_was_restarted(
    memory_of, hall_plan, file, lines
):
    save_pose(file, saved(hall_plan))
    hint = at_start(memory_of(), hall_plan, T_odom_base=SE2.identity())
    assert hint.T_map_base == THERE
    assert "as it was saved" in lines[0][1]


def test_a_saved_pose_of_another_map_or_time_is_none(memory_of, hall_plan, file, lines):
    save_pose(file, saved(identical_rooms(2)))
    assert at_start(memory_of(), hall_plan) is None
    save_pose(file, saved(hall_plan, stamp=1e6))
    assert at_start(memory_of(), hall_plan) is None
    save_pose(file, saved(hall_plan))
    assert at_start(memory_of(), hall_plan, T_odom_base=SE2(50.0, 5.0, 0.0)) is None
    assert [text.partition(": ")[0] for _, text in lines] == ["the saved pose is not used"] * 3
    assert file.exists()


@pytest.mark.parametrize("content", [b"", b"{", b"\x00" * 500, b"[]", b"x" * 100_000])
def test_a_broken_file_is_reported_in_one_line_and_left_unchanged(
    memory_of, hall_plan, file, lines, content
):
    file.write_bytes(content)
    assert at_start(memory_of(), hall_plan) is None
    ((severity, text),) = lines
    assert severity is Severity.WARNING
    assert text.startswith("the saved pose cannot be used: expected")
    assert "\n" not in text
    assert file.read_bytes() == content


def test_at_the_first_start_there_is_no_saved_pose(memory_of, hall_plan, file, lines):
    assert at_start(memory_of(), hall_plan) is None
    assert lines == [(Severity.INFO, f"no saved pose in {file} yet")]


def test_odometry_may_come_before_the_map(memory_of, hall_plan, file):
    save_pose(file, saved(hall_plan))
    memory = memory_of()
    assert memory.hint_after(Odometry(200.0, COUNTED_LATER)) is None
    assert memory.hint_after(NewMap(0.0, hall_plan)).source == "the saved pose"
    assert memory.hint_after(Odometry(201.0, COUNTED_LATER)) is None
    assert memory.hint_after(NewMap(0.0, identical_rooms(1))) is None


def test_initial_pose_is_a_hint_for_the_first_map(memory_of, hall_plan):
    memory = memory_of(set_initial_pose=True, initial_pose=THERE)
    hint = at_start(memory, hall_plan)
    assert (hint.T_map_base, hint.source) == (THERE, "initial_pose")
    assert memory.hint_after(NewMap(0.0, identical_rooms(1))) is None


def test_initial_pose_can_be_asked_for_with_every_map(memory_of, hall_plan, file, lines):
    save_pose(file, saved(hall_plan, T_map_base=SE2(1.0, 1.0, 0.0)))
    memory = memory_of(set_initial_pose=True, initial_pose=THERE, always_reset_initial_pose=True)
    assert at_start(memory, hall_plan).T_map_base == THERE
    assert memory.hint_after(NewMap(0.0, identical_rooms(1))).T_map_base == THERE
    assert lines == []


def test_a_saved_pose_comes_before_initial_pose_and_that_before_nothing(memory_of, hall_plan, file):
    asked = {"set_initial_pose": True, "initial_pose": SE2(1.0, 1.0, 0.0)}
    assert at_start(memory_of(**asked), hall_plan).source == "initial_pose"
    save_pose(file, saved(hall_plan))
    assert at_start(memory_of(**asked), hall_plan).source == "the saved pose"
    assert at_start(memory_of(initial_pose=THERE, path=""), hall_plan) is None


def test_a_hint_of_a_person_takes_precedence(memory_of, hall_plan, file):
    save_pose(file, saved(hall_plan))
    memory = memory_of()
    memory.hint_after(NewMap(0.0, hall_plan))
    memory.hint_after(PoseHint(0.0, SE2.identity()))
    assert memory.hint_after(Odometry(200.0, COUNTED_LATER)) is None


# ---- a whole node, started twice


class Life:
    """A started node and its robot."""

    def __init__(self, wire, robot, file, **parameters):
        self.recorder = Recorder(wire)
        self._robot = robot
        self._looked = threading.Event()
        config = NodeConfig(
            mode=Mode.FULL,
            saved_pose_file=str(file),
            save_pose_rate=5.0,
            scan_timeout=0.0,  # a busy machine may need longer than that between two scans
            **parameters,
        )
        self._node = Node(config, self.recorder, [self._watch])
        self.state = State.NO_MAP

    def _watch(self, given, outputs, localizer):
        self.state = localizer.state
        if isinstance(given, LaserScan):
            self._looked.set()

    def __enter__(self):
        self._node.start()
        self._node.receive(Channel.MAP, self._robot.map())
        self._node.receive(Channel.TF_STATIC, self._robot.fixed())
        self.look()
        return self

    def __exit__(self, *_):
        self._node.stop()

    def look(self):
        """Let the robot report, and wait until the node has processed it."""
        self._robot.move()
        self._looked.clear()
        self._robot.report(self._node.receive)
        assert self._looked.wait(240.0)

    def receive(self, received, message=None):
        self._node.receive(received, message)

    @property
    def reason(self):
        return self.recorder.on(STATUS)[-1].status[0].message

    @property
    def pose(self):
        return to_planar(to_pose(self.recorder.on(AMCL_POSE)[-1]))


IN_ROOM_1 = SE2(8.0 + 4.7, 3.6, -2.4)


def test_in_a_building_of_equal_rooms_a_restarted_node_finds_its_room(ros2, file):
    robot = Speaker(ros2, identical_rooms(3), IN_ROOM_1)
    with Life(ros2, robot, file) as first:
        assert first.state is State.DISAMBIGUATING  # no scan can decide
        person = pose_with_covariance(ros2.make, 0.0, "map", IN_ROOM_1, np.eye(3))
        first.receive(Channel.INITIAL_POSE, person)
        first.look()
        assert first.state is State.LOCALIZED
    assert load_pose(file).T_map_base.distance_to(IN_ROOM_1) < 0.1
    with Life(ros2, robot, file) as second:
        assert second.state is State.LOCALIZED
        assert second.pose.distance_to(IN_ROOM_1) < 0.1
        assert second.reason.startswith("LOCALIZED: chosen by the saved pose; ")
        (line,) = [
            x for x in second.recorder.logged(Severity.INFO) if x.startswith("the saved pose")
        ]
        assert "moved along with odometry" in line


def test_a_robot_that_was_pushed_a_little_meanwhile_is_found_there(ros2, file):
    robot = Speaker(ros2, identical_rooms(3), IN_ROOM_1)
    save_pose(file, saved(robot.world, 90.0, IN_ROOM_1 @ SE2(0.5, -0.3, 0.3), robot.T_odom_base))
    with Life(ros2, robot, file) as life:
        assert life.pose.distance_to(IN_ROOM_1) < 0.1


def test_a_saved_pose_that_is_wrong_does_not_win(ros2, hall_plan, file):
    """The robot was carried while it was off."""
    robot = Speaker(ros2, hall_plan, THERE)
    save_pose(file, saved(hall_plan, 90.0, SE2(7.5, 1.0, -2.0), robot.T_odom_base))
    with Life(ros2, robot, file) as life:
        life.look()
        assert life.pose.distance_to(THERE) < 0.1
        stamps = [to_pose(message).stamp for message in life.recorder.on(AMCL_POSE)]
        assert stamps == [robot.stamp]
    assert load_pose(file).T_map_base.distance_to(THERE) < 0.1


def test_a_robot_that_was_picked_up_has_no_saved_pose(ros2, file):
    robot = Speaker(ros2, identical_rooms(3), IN_ROOM_1)
    save_pose(file, saved(robot.world, 90.0, IN_ROOM_1, robot.T_odom_base))
    with Life(ros2, robot, file) as life:
        life.receive(Channel.WHEEL_DROP, ros2.make("kobuki/WheelDropEvent", wheel=0, state=1))
        wait_for(lambda: not file.exists())
    assert not file.exists()


def test_initial_pose_decides_between_equal_rooms(ros2, tmp_path):
    robot = Speaker(ros2, identical_rooms(3), IN_ROOM_1)
    asked = {"set_initial_pose": True, "initial_pose": IN_ROOM_1}
    with Life(ros2, robot, tmp_path / "pose.json", **asked) as life:
        assert life.pose.distance_to(IN_ROOM_1) < 0.1
        assert life.reason.startswith("LOCALIZED: chosen by initial_pose; ")


def test_a_node_continues_where_poses_cannot_be_saved(ros2, hall_plan, tmp_path):
    robot = Speaker(ros2, hall_plan, THERE)
    with Life(ros2, robot, tmp_path / "no" / "folder" / "pose.json") as life:
        for _ in range(6):
            life.look()
        assert life.state is State.LOCALIZED
    warnings = life.recorder.logged(Severity.WARNING)
    assert [text.startswith("the pose is not saved") for text in warnings].count(True) == 1
