"""The DDS domain, from the environment variables of ROS."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from firstfix.core.errors import InputError

_LAST_DOMAIN = 232  # beyond it there are no ports
_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")
# So many processes of one machine find each other without multicast; rmw_cyclonedds' number.
_PROCESSES = 32
_BEFORE_IRON = ("foxy", "galactic", "humble")
# ROS 2 identifies messages by their names. Fast DDS (1.15) describes its types in another way than
# Cyclone DDS (1.16), and endpoints whose descriptions differ would not match.
_NAMES_COUNT = (
    "<Compatibility><IgnoreTypeInformation>1.1,1.15,1.16</IgnoreTypeInformation></Compatibility>"
)


@dataclass(frozen=True, slots=True)
class DomainSettings:
    """A domain of DDS.

    Parameters
    ----------
    number : int
        ``ROS_DOMAIN_ID``.
    configuration : str
        Of Cyclone DDS: fragments of XML, or files, with commas between them; the last one counts.
    """

    number: int
    configuration: str


def is_before_iron(environment: Mapping[str, str] = os.environ) -> bool:
    """Return whether ``ROS_DISTRO`` names a distribution before Iron."""
    return environment.get("ROS_DISTRO", "") in _BEFORE_IRON


def domain_settings(environment: Mapping[str, str] = os.environ) -> DomainSettings:
    """Read the variables of ROS; CYCLONEDDS_URI overrides them.

    Parameters
    ----------
    environment : mapping of str to str
        Of the process.

    Returns
    -------
    DomainSettings
        The same as rmw_cyclonedds would use.

    Raises
    ------
    InputError
        If a variable has an invalid value.
    """
    own = f"<CycloneDDS><Domain>{_NAMES_COUNT}{_discovery(environment)}</Domain></CycloneDDS>"
    configuration = ",".join(filter(None, (own, environment.get("CYCLONEDDS_URI", ""))))
    if not configuration.isascii():
        raise InputError(
            expected="CYCLONEDDS_URI and ROS_STATIC_PEERS in ASCII",
            received=f"{configuration!a:.60}",
            remedy="move the file to a folder with a plain name",
        )
    return DomainSettings(_number(environment.get("ROS_DOMAIN_ID") or "0"), configuration)


def _number(text: str) -> int:
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 5 else -1
    if not 0 <= number <= _LAST_DOMAIN:
        raise InputError(
            expected=f"ROS_DOMAIN_ID from 0 to {_LAST_DOMAIN}",
            received=f"{text!r:.60}",
            remedy="set it as on the robot",
        )
    return number


def _discovery(environment: Mapping[str, str]) -> str:
    """Return the configuration of discovery."""
    is_local = environment.get("ROS_LOCALHOST_ONLY") == "1"
    default = "LOCALHOST" if is_local else "SUBNET"
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or default
    if is_local:  # in ROS the older variable wins if both are set
        reach = "LOCALHOST"
    if reach not in _RANGES:
        raise InputError(
            expected=f"ROS_AUTOMATIC_DISCOVERY_RANGE as one of {', '.join(_RANGES)}",
            received=f"{reach!r:.60}",
            remedy="unset it to find the robots of the local network",
        )
    if reach == "OFF":
        # No other participant has the same tag.
        alone = f"<ParticipantIndex>none</ParticipantIndex><Tag>firstfix_{os.getpid()}</Tag>"
        return f"{_NO_MULTICAST}<Discovery>{alone}</Discovery>"
    if reach == "LOCALHOST" and is_before_iron(environment):
        return _LOOPBACK + _peers(["127.0.0.1"])
    text = "" if is_local or reach == "SYSTEM_DEFAULT" else environment.get("ROS_STATIC_PEERS", "")
    peers = [peer.strip() for peer in text.split(";") if peer.strip()]
    if reach == "LOCALHOST":
        return _NO_MULTICAST + _peers(["localhost", *peers])
    return _peers(peers) if peers else ""


def _peers(peers: Sequence[str]) -> str:
    """Return the configuration that looks for processes at these addresses, beside multicast."""
    listed = "".join(f"<Peer address={quoteattr(peer)}/>" for peer in peers)
    index = f"<MaxAutoParticipantIndex>{_PROCESSES}</MaxAutoParticipantIndex>"
    index = f"<ParticipantIndex>auto</ParticipantIndex>{index}"
    return f"<Discovery>{index}<Peers>{listed}</Peers></Discovery>"


_NO_MULTICAST = "<General><AllowMulticast>false</AllowMulticast></General>"
# Before Iron, ROS_LOCALHOST_ONLY restricts ROS to this interface, and multicast goes on there.
_LOOPBACK = "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
