"""Between callbacks and the worker: the newest scan wins, nothing else is lost."""

import threading

from hypothesis import given
from hypothesis import strategies as st

from firstfix.ros.inbox import Inbox

items = st.lists(st.tuples(st.booleans(), st.integers()), max_size=30)


@given(items)
def test_all_but_scans_come_in_order_then_the_newest_scan(given_):
    inbox = Inbox()
    for is_scan, item in given_:
        (inbox.put_scan if is_scan else inbox.put)((is_scan, item))
    scans = [entry for entry in given_ if entry[0]]
    others = [entry for entry in given_ if not entry[0]]
    assert inbox.take(0.0) == others + scans[-1:]
    assert inbox.take(0.0) == []


def test_a_scan_may_be_anything_but_none():
    inbox = Inbox()
    inbox.put_scan(0)
    assert inbox.take(0.0) == [0]


def test_take_waits_for_a_message():
    inbox: Inbox[int] = Inbox()
    taken: list[int] = []
    worker = threading.Thread(target=lambda: taken.extend(inbox.take(60.0)))
    worker.start()
    inbox.put(7)
    worker.join(60.0)
    assert taken == [7]


def test_closing_wakes_the_worker_and_ends_the_queue():
    inbox: Inbox[int] = Inbox()
    taken: list[list[int]] = []
    worker = threading.Thread(target=lambda: taken.append(inbox.take(60.0)))
    worker.start()
    inbox.close()
    worker.join(60.0)
    assert taken == [[]]
    assert inbox.is_closed
    inbox.put(1)
    inbox.put_scan(2)
    assert inbox.take(0.0) == []


def test_many_callbacks_at_once_lose_nothing():
    inbox: Inbox[tuple[int, int]] = Inbox()
    taken: list[tuple[int, int]] = []

    def call_back(caller: int) -> None:
        for i in range(500):
            inbox.put((caller, i))
            inbox.put_scan((caller, -i))

    threads = [threading.Thread(target=call_back, args=(caller,)) for caller in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        taken += inbox.take(0.01)
    taken += inbox.take(0.0)
    for caller in range(4):
        assert [i for at, i in taken if at == caller and i > 0] == list(range(1, 500))
