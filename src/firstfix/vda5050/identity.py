"""Who the robot is on the broker, and the topics that follow from it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from firstfix.core.errors import InputError

_LONGEST = 128
_SERIAL = re.compile(r"[A-Za-z0-9_.:-]+")
# Levels of topics, wildcards and reserved topics of MQTT; control characters.
_NOT_IN_TOPICS = re.compile(r"[/+#$\x00-\x1f\x7f]")


class Version(Enum):
    """A version of VDA 5050, in the words of its headers."""

    V2 = "2.1.0"
    V3 = "3.0.0"


# The interface name and the major version that each version suggests for its topics.
_ROOTS = {Version.V2: "uagv/v2", Version.V3: "vda5050/v3"}


@dataclass(frozen=True, slots=True)
class Identity:
    """Manufacturer and serial number of a robot.

    Parameters
    ----------
    manufacturer : str
        Without characters that have a meaning in topics.
    serial_number : str
        Of letters, digits and ``_.:-``.
    version : Version
        Of VDA 5050.

    Raises
    ------
    InputError
        If a name cannot be part of a topic.
    """

    manufacturer: str
    serial_number: str
    version: Version = Version.V2

    def __post_init__(self) -> None:
        name = self.manufacturer
        if not 0 < len(name) <= _LONGEST or not name.isprintable() or _NOT_IN_TOPICS.search(name):
            raise InputError(
                expected=f"a manufacturer of 1 to {_LONGEST} characters without / + # $",
                received=f"{name!r:.60}",
                remedy="write it as in the topics of the fleet control",
            )
        if len(self.serial_number) > _LONGEST or not _SERIAL.fullmatch(self.serial_number):
            raise InputError(
                expected="a serial number of letters, digits and _ . : -",
                received=f"{self.serial_number!r:.60}",
                remedy="write it as in the topics of the fleet control",
            )

    def topic(self, name: str) -> str:
        """Return the full name of a topic, such as ``uagv/v2/ACME/0001/state``."""
        return f"{_ROOTS[self.version]}/{self.manufacturer}/{self.serial_number}/{name}"
