"""The master of ROS 1: notice that another one took over, and tell it everything again."""

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

# What a master can do to its callers: be away, be about to begin, say no, or talk nonsense.
_ABSENT = (OSError, http.client.HTTPException, xmlrpc.client.Error, rosgraph.MasterException)


def wait_for_master() -> bool:
    """Wait until there is a master: without one, rospy cannot take parameters of its arguments.

    Returns
    -------
    bool
        False if a person got tired of it.
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
    """Tell whether there is a master that does not know this node, because it is a new one.

    Its process id would not tell: in a container, the next master often has the same one.

    Returns
    -------
    bool
        False where no master answers.
    """
    try:
        _master().lookupNode(rospy.get_name())
    except rosgraph.MasterError:
        return True
    except _ABSENT:
        return False
    return False


def register_anew(services: Sequence[rospy.Service]) -> bool:
    """Tell the master all topics and services of this node.

    Connections that outlived the old master are not cut: drivers that do not register anew
    themselves go on talking to this node over them.

    Parameters
    ----------
    services : sequence of rospy.Service
        Those of this node; its topics, it knows itself.

    Returns
    -------
    bool
        False if the master went away meanwhile.
    """
    try:
        _register(_master(), services)
    except _ABSENT:
        return False
    return True


def _register(master: Any, services: Sequence[rospy.Service]) -> None:
    uri, name = rospy.get_node_uri(), rospy.get_name()
    # Asked over the wire, as other tools do it: also of what rospy itself publishes and hears,
    # such as rosout and clock, which no variable of ours holds.
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
