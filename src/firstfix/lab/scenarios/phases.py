"""All phases that a scenario can have, behind one door."""

from firstfix.lab.scenarios.disturbances import CarryTo, Grip, Slip, SlipKind, Teleport
from firstfix.lab.scenarios.motions import Crowd, DriveTo, Pause, Spin, Stand, Wander
from firstfix.lab.scenarios.phase import Phase
from firstfix.lab.simulation.people import Manner

__all__ = [
    "CarryTo",
    "Crowd",
    "DriveTo",
    "Grip",
    "Manner",
    "Pause",
    "Phase",
    "Slip",
    "SlipKind",
    "Spin",
    "Stand",
    "Teleport",
    "Wander",
]
