"""The master of ROS 1: detect a restart, and register again."""

from __future__ import annotations

import http.client
import sys
import time
import xmlrpc.client
from collections.abc import Sequence
from typing import Any

import rosgraph
import rospy

_ASK_AGAIN_S = 0.3

# A master may be absent, starting, refuse a call, or answer nonsense.
_ABSENT = (OSError, http.client.HTTPException, xmlrpc.client.Error, rosgraph.MasterException)


def wait_for_master() -> bool:
    """Wait for the master: without one, rospy cannot set parameters from its arguments.

    Returns
    -------
    bool
        False after Ctrl-C.
    """
    try:
        if not rosgraph.is_master_online():
            uri = rosgraph.get_master_uri()
            sys.stderr.write(f"firstfix: waiting for the ROS master at {uri}\n")
        while not rosgraph.is_master_online():
            time.sleep(_ASK_AGAIN_S)
    except KeyboardInterrupt:
        return False
    return True


def is_forgotten() -> bool:
    """Return whether the master does not know this node, because it was restarted.

    Its process id is no evidence: in a container, the next master often has the same one.

    Returns
    -------
    bool
        False if no master answers.
    """
    try:
        _master().lookupNode(rospy.get_name())
    except rosgraph.MasterError:
        return True
    except _ABSENT:
        return False
    return False


def register_anew(services: Sequence[rospy.Service]) -> bool:
    """Register all topics and services of this node again.

    Connections that outlived the old master stay open: drivers that do not register again keep
    using them.

    Parameters
    ----------
    services : sequence of rospy.Service
        Those of this node; rospy knows its topics.

    Returns
    -------
    bool
        False if the master disappeared meanwhile.
    """
    try:
        _register(_master(), services)
    except _ABSENT:
        return False
    return True


def _register(master: Any, services: Sequence[rospy.Service]) -> None:
    uri, name = rospy.get_node_uri(), rospy.get_name()
    # Queried over XML-RPC, as other tools do: so the topics of rospy itself, such as rosout and
    # clock, are included.
    with xmlrpc.client.ServerProxy(uri) as proxy:
        own: Any = proxy
        for topic, kind in own.getPublications(name)[2]:
            master.registerPublisher(topic, kind, uri)
        for topic, kind in own.getSubscriptions(name)[2]:
            publishers = master.registerSubscriber(topic, kind, uri)
            own.publisherUpdate("/master", topic, publishers)
    for service in services:
        master.registerService(service.resolved_name, service.uri, uri)


def _master() -> Any:
    return rosgraph.Master(rospy.get_name())
