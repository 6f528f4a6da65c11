"""All phases that a scenario can have, behind one door."""

from firstfix.sim.mishaps import CarryTo, Grip, Slip, SlipKind, Teleport
from firstfix.sim.motions import Crowd, DriveTo, Pause, Spin, Stand, Wander
from firstfix.sim.people import Manner
from firstfix.sim.phase import Phase

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
