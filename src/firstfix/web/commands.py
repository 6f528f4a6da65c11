"""The commands of clients: one struct declares, checks, decodes and documents each."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from firstfix.core.se2 import SE2
from firstfix.web.snapshot import AmclStart

# Larger than any building, and small enough for indices of cells.
FARTHEST_M = 1e6
MOST_PEOPLE = 30

X = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M, description="x in the map frame, m")]
Y = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M, description="y in the map frame, m")]
Yaw = Annotated[
    float,
    Meta(ge=-FARTHEST_M, le=FARTHEST_M, description="heading, rad, counter-clockwise from +x"),
]
Name = Annotated[str, Meta(max_length=200, description="one of the names in hello")]


class Pose(Struct, frozen=True):
    """A pose of the robot's base in the map frame."""

    x: X
    y: Y
    yaw: Yaw

    @property
    def T_map_base(self) -> SE2:
        """The pose as a transform."""
        return SE2(self.x, self.y, self.yaw)


class SetPose(Pose, frozen=True, tag_field="type", tag="pose"):
    """A person says where the robot is."""


class PickPlace(Struct, frozen=True, tag_field="type", tag="pick"):
    """A person chooses one of the hypotheses."""

    id: Annotated[int, Meta(ge=0, description="id of the hypothesis")]


class Relocalize(Struct, frozen=True, tag_field="type", tag="relocalize"):
    """Discard the pose and search the whole map."""


class Pause(Struct, frozen=True, tag_field="type", tag="pause"):
    """Stop or resume the clock of the simulated robot."""

    paused: bool


class DriveTo(Struct, frozen=True, tag_field="type", tag="goal"):
    """Send the simulated robot to a point."""

    x: X
    y: Y


class Carry(Pose, frozen=True, tag_field="type", tag="carry"):
    """Pick the simulated robot up and set it down at a pose."""


class SetPeople(Struct, frozen=True, tag_field="type", tag="people"):
    """Let people walk around the simulated robot."""

    count: Annotated[int, Meta(ge=0, le=MOST_PEOPLE, description="number of people")]


class Kidnap(Struct, frozen=True, tag_field="type", tag="kidnap"):
    """Teleport the simulated robot to a random place, with no signal of any sensor."""


class CoverSensor(Struct, frozen=True, tag_field="type", tag="cover"):
    """Cover or uncover the sensor of the simulated robot."""

    covered: bool


class SelectSensor(Struct, frozen=True, tag_field="type", tag="sensor"):
    """Exchange the sensor of the simulated robot."""

    name: Name


class SelectWorld(Struct, frozen=True, tag_field="type", tag="world"):
    """Restart the simulation in another world."""

    name: Name


class Decide(Struct, frozen=True, tag_field="type", tag="decide"):
    """Let the simulated robot execute the deciding motion."""


class RunAmcl(Struct, frozen=True, tag_field="type", tag="amcl"):
    """Run a plain AMCL beside the localizer of the simulated robot, or end it."""

    start: Annotated[AmclStart, Meta(description="off, pose (the last one), uniform")]


class Token(Struct, frozen=True, tag_field="type", tag="token"):
    """Authenticate; the first message where the server asks for a token."""

    token: str


SimulationCommand = (
    Pause
    | DriveTo
    | Carry
    | SetPeople
    | Kidnap
    | CoverSensor
    | SelectSensor
    | SelectWorld
    | Decide
    | RunAmcl
)
Command = SetPose | PickPlace | Relocalize | SimulationCommand
ClientMessage = Command | Token
