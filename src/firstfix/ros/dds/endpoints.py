"""Writers and readers of topics in DDS, and a thread that waits for their events."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable, Iterable
from typing import Any

from cyclonedds.core import (
    Entity,
    GuardCondition,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import dds_infinity
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

from firstfix.ros.channels import Topic
from firstfix.ros.dds.qos import STATUS_OF_READERS, STATUS_OF_WRITERS, mismatch, quality
from firstfix.ros.dds.types import Cdr, described, encode

# A discovered subscriber may need this long to discover the publisher, s.
_SETTLING_S = 0.5
_MOST_AT_ONCE = 100
# Pause after an error that may repeat.
_PAUSE_S = 1.0
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


class Sender:
    """Publishes a topic.

    Parameters
    ----------
    participant : DomainParticipant
        Of the node.
    topic : Topic
        Its type and delivery are used.
    name : str
        Its name in DDS.
    """

    def __init__(self, participant: DomainParticipant, topic: Topic, name: str) -> None:
        self.name = name.removeprefix("rt")
        self._type_name = topic.type_name
        self._since: dict[int, float] = {}
        described_topic, qos = _described(participant, topic, name), quality(topic)
        self.entity = DataWriter(participant, described_topic, qos=qos)
        self.entity.set_status_mask(STATUS_OF_WRITERS)

    @property
    def subscriber_count(self) -> int:
        """Number of subscribers that have had time to discover this sender."""
        now = time.monotonic()
        return sum(now - since >= _SETTLING_S for since in [*self._since.values()])

    def send(self, message: Any) -> None:
        """Publish a message."""
        self.entity.write(Cdr(encode(self._type_name, message)))

    def check_matches(self) -> str | None:
        """Update the subscribers, and describe one whose quality of service does not match."""
        now, known = time.monotonic(), self._since
        self.entity.get_publication_matched_status()  # so that it can change again
        matched = self.entity.get_matched_subscriptions()
        self._since = {handle: known.get(handle, now) for handle in matched}
        return mismatch(self.entity)


class Receiver:
    """Subscribes to a topic.

    Parameters
    ----------
    participant : DomainParticipant
        Of the node.
    topic : Topic
        Its type and delivery are used.
    name : str
        Its name in DDS.
    """

    def __init__(self, participant: DomainParticipant, topic: Topic, name: str) -> None:
        self.name = name.removeprefix("rt")
        self.type_name = topic.type_name
        described_topic, qos = _described(participant, topic, name), quality(topic)
        self.entity = DataReader(participant, described_topic, qos=qos)
        self.entity.set_status_mask(STATUS_OF_READERS)
        self.news = ReadCondition(self.entity, _ANY)

    def take(self) -> list[bytes]:
        """Return the messages since the last call, oldest first."""
        samples = self.entity.take(_MOST_AT_ONCE, self.news)
        return [sample.data for sample in samples if sample.sample_info.valid_data]

    def check_matches(self) -> str | None:
        """Describe a publisher whose quality of service does not match."""
        return mismatch(self.entity)


class EventThread:
    """A thread that handles events of DDS entities, and sleeps otherwise.

    Listeners of DDS are not used: they would wait for Python's lock in the receive thread, and
    Python may hold that lock until this very thread has received an acknowledgement.

    Parameters
    ----------
    participant : DomainParticipant
        Of the node.
    entities : iterable of Entity
        Conditions, or ends with a status mask.
    handle : callable
        Must clear the event.
    warn : callable
        Takes the subject and one sentence for people, should looking fail.
    """

    def __init__(
        self,
        participant: DomainParticipant,
        entities: Iterable[Entity],
        handle: Callable[[], None],
        warn: Callable[[str, str], None],
    ) -> None:
        self._handle = handle
        self._warn = warn
        self._bell = GuardCondition(participant)
        self._waitset = WaitSet(participant)
        for entity in (self._bell, *entities):
            self._waitset.attach(entity)
        self._thread = threading.Thread(target=self._run, name="firstfix-dds", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._bell.set(triggered=True)
        self._thread.join()

    def _run(self) -> None:
        while True:
            self._waitset.wait(dds_infinity)
            if self._bell.read():
                return
            try:
                self._handle()
            except Exception:  # noqa: BLE001 - a thread that ends silently would be worse
                self._warn("dds", f"an error of firstfix itself:\n{traceback.format_exc()}")
                time.sleep(_PAUSE_S)


def _described(participant: DomainParticipant, topic: Topic, name: str) -> DdsTopic[Any]:
    made = DdsTopic(participant, name, described(topic.type_name))
    made.data_type = Cdr
    return made
