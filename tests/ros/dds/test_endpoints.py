import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.domain import Domain, DomainParticipant
from dds_lab import LOOPBACK, free_domain, wait_for

from firstfix.ros.channels import Delivery, Topic
from firstfix.ros.dds.endpoints import EventThread, Receiver, Sender
from firstfix.ros.dds.types import decode, make

RELIABLE = Topic("flag", "std_msgs/Bool", Delivery.RELIABLE)
LATCHED = Topic("flag", "std_msgs/Bool", Delivery.LATCHED)
SENSOR = Topic("flag", "std_msgs/Bool", Delivery.SENSOR)
YES = make("std_msgs/Bool", data=True)


@pytest.fixture
def other(dds):
    """A participant besides that of the lab, in the same domain."""
    return DomainParticipant(dds.domain)


def matched(sender):
    return sender.entity.get_matched_subscriptions


def test_messages_arrive_at_others_and_not_at_the_sender(dds, other):
    sender = Sender(dds.participant, RELIABLE, "rt/flag")
    here = Receiver(dds.participant, RELIABLE, "rt/flag")
    there = Receiver(other, RELIABLE, "rt/flag")
    wait_for(matched(sender))
    sender.send(YES)
    data = wait_for(there.take)
    assert [decode("std_msgs/Bool", one).data for one in data] == [True]
    assert here.take() == []
    assert there.name == "/flag"


def test_only_latched_topics_reach_late_subscribers(dds, other):
    sender = Sender(dds.participant, LATCHED, "rt/latched")
    volatile = Sender(dds.participant, RELIABLE, "rt/volatile")
    for value in (True, False):
        sender.send(make("std_msgs/Bool", data=value))
        volatile.send(make("std_msgs/Bool", data=value))
    late = Receiver(other, LATCHED, "rt/latched")
    late_too = Receiver(other, RELIABLE, "rt/volatile")
    (data,) = wait_for(late.take)
    assert decode("std_msgs/Bool", data).data is False  # the last one
    wait_for(matched(volatile))
    assert late_too.take() == []


def test_the_last_message_of_each_sender_reaches_late_subscribers(dds, other):
    many = Topic("static", "tf2_msgs/TFMessage", Delivery.LATCHED_MANY)
    message = make("tf2_msgs/TFMessage", transforms=[])
    senders = [Sender(p, many, "rt/static") for p in (dds.participant, other)]
    for sender in senders:
        sender.send(message)
    late = Receiver(DomainParticipant(dds.domain), many, "rt/static")
    received = []
    wait_for(lambda: received.extend(late.take()) or len(received) == 2)


def test_a_sender_that_goes_leaves_no_message(dds, other):
    receiver = Receiver(other, LATCHED, "rt/flag")
    sender = Sender(dds.participant, LATCHED, "rt/flag")
    sender.send(YES)
    wait_for(receiver.take)
    sender.entity._delete(sender.entity._ref)
    wait_for(lambda: not receiver.entity.get_matched_publications())
    assert receiver.take() == []


@pytest.mark.parametrize("offered", [SENSOR, RELIABLE, LATCHED])
def test_scans_are_received_with_any_reliability(dds, other, offered):
    sender = Sender(dds.participant, offered, "rt/scan")
    receiver = Receiver(other, SENSOR, "rt/scan")
    wait_for(matched(sender))
    sender.send(YES)
    wait_for(receiver.take)


@pytest.mark.parametrize(
    ("offered", "asked", "policy"),
    [(RELIABLE, LATCHED, "durability"), (SENSOR, RELIABLE, "reliability")],
)
def test_both_ends_report_the_incompatible_policy(dds, other, offered, asked, policy):
    sender = Sender(dds.participant, offered, "rt/flag")
    receiver = Receiver(other, asked, "rt/flag")
    assert f"a publisher does not fit in {policy}: " in wait_for(receiver.check_matches)
    assert f"a subscriber does not fit in {policy}: " in wait_for(sender.check_matches)
    assert receiver.check_matches() is None  # once is enough
    assert sender.check_matches() is None


def test_compatible_ends_report_nothing(dds, other):
    sender = Sender(dds.participant, RELIABLE, "rt/flag")
    receiver = Receiver(other, RELIABLE, "rt/flag")
    wait_for(matched(sender))
    assert (sender.check_matches(), receiver.check_matches()) == (None, None)


def test_subscribers_count_after_the_time_of_discovery(dds, other, monkeypatch):
    sender = Sender(dds.participant, RELIABLE, "rt/flag")
    receiver = Receiver(other, RELIABLE, "rt/flag")
    wait_for(matched(sender))
    monkeypatch.setattr("firstfix.ros.dds.endpoints._SETTLING_S", 1e9)
    sender.check_matches()
    assert sender.subscriber_count == 0
    monkeypatch.setattr("firstfix.ros.dds.endpoints._SETTLING_S", 0.0)
    assert sender.subscriber_count == 1
    receiver.entity._delete(receiver.entity._ref)
    wait_for(lambda: sender.check_matches() or sender.subscriber_count == 0)


def test_domains_are_separate(dds):
    number = free_domain()
    elsewhere = Domain(number, LOOPBACK)
    far = Receiver(DomainParticipant(number), LATCHED, "rt/flag")
    near = Receiver(DomainParticipant(dds.domain), LATCHED, "rt/flag")
    Sender(dds.participant, LATCHED, "rt/flag").send(YES)
    wait_for(near.take)
    assert far.take() == []
    del elsewhere


def test_a_callback_is_called_for_each_message_and_its_error_is_survived(dds, other):
    sender = Sender(dds.participant, RELIABLE, "rt/flag")
    receiver = Receiver(other, RELIABLE, "rt/flag")
    received, complaints = [], []

    def look():
        received.extend(receiver.take())
        if len(received) == 1:
            raise OSError("no such luck")

    watch = EventThread(other, [receiver.news], look, lambda *what: complaints.append(what))
    wait_for(matched(sender))
    sender.send(YES)
    ((subject, text),) = wait_for(lambda: complaints)
    assert subject == "dds"
    assert "no such luck" in text
    sender.send(YES)
    wait_for(lambda: len(received) == 2)
    watch.close()
    sender.send(YES)
    assert wait_for(receiver.take)
