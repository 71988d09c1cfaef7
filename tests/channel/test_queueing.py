"""The queues: who goes first, and who goes away."""

from __future__ import annotations

from collections import namedtuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.queueing import DISCIPLINES, DROPS, Fifo, Newest, Priority

Item = namedtuple("Item", "number topic priority keep", defaults=(False,))


def items(*priorities, topics=""):
    return [Item(i, topics[i : i + 1] or "t", p) for i, p in enumerate(priorities)]


def emptied(queue):
    return [queue.pop().number for _ in range(len(queue))]


def filled(queue, some):
    gone = [queue.push(item) for item in some]
    return [(g[0].number, g[1]) for g in gone if g]


def test_fifo_ignores_urgency():
    queue = Fifo()
    assert filled(queue, items(0, 5, 2)) == []
    assert emptied(queue) == [0, 1, 2]


def test_the_most_urgent_goes_first_and_among_equals_the_first_come():
    queue = Priority()
    filled(queue, items(0, 5, -2, 5, 0))
    assert emptied(queue) == [1, 3, 0, 4, 2]


@pytest.mark.parametrize(("drop", "gone", "stays"), [("tail", [2, 3], [0, 1]), ("head", [0, 1], [2, 3])])
def test_a_full_queue_drops_the_newest_or_the_oldest(drop, gone, stays):
    for queue in (Fifo(2, drop), Newest(2, drop)):
        assert filled(queue, items(0, 0, 0, 0, topics="abcd")) == [(n, "queue_full") for n in gone]
        assert emptied(queue) == stays


@pytest.mark.parametrize(("drop", "gone", "stays"), [("tail", [2, 0], [3, 1]), ("head", [0, 2], [3, 1])])
def test_a_full_queue_drops_the_least_urgent(drop, gone, stays):
    queue = Priority(2, drop)
    assert filled(queue, items(0, 1, 0, 2)) == [(n, "queue_full") for n in gone]
    assert emptied(queue) == stays


def test_a_newcomer_that_is_least_urgent_goes_itself():
    queue = Priority(1, "head")
    assert filled(queue, items(3, 2)) == [(1, "queue_full")]


def test_a_newer_state_takes_the_place_of_the_older_and_needs_no_room():
    queue = Newest(2)
    assert filled(queue, items(0, 0, 0, topics="aba")) == [(0, "superseded")]
    assert emptied(queue) == [2, 1]


@pytest.mark.parametrize("name", sorted(DISCIPLINES))
def test_what_is_under_way_comes_back_first_takes_no_room_and_stays(name):
    queue = DISCIPLINES[name](1, "head")
    first, second, third = items(0, 0, 0)
    queue.push(first)
    assert queue.pop() is first
    queue.put_back(first)
    assert queue.push(second) is None
    # Room for one: the second goes, never the one under way.
    assert queue.push(third)[0] is second
    assert [x.number for x in queue] == [0, 2]
    assert emptied(queue) == [0, 2]


def test_what_is_under_way_gives_way_to_the_more_urgent_and_goes_ahead_of_its_equals():
    queue = Priority()
    first, equal, urgent = items(0, 0, 1)
    queue.push(first)
    queue.pop()
    queue.push(equal)
    queue.push(urgent)
    queue.put_back(first)
    assert emptied(queue) == [2, 0, 1]


@pytest.mark.parametrize("name", sorted(DISCIPLINES))
def test_an_empty_queue_says_so(name):
    queue = DISCIPLINES[name]()
    assert len(queue) == 0
    assert list(queue) == []
    with pytest.raises(IndexError):
        queue.pop()


@pytest.mark.parametrize("name", sorted(DISCIPLINES))
@given(
    st.sampled_from(DROPS),
    st.integers(0, 3),
    st.lists(st.one_of(st.just("pop"), st.tuples(st.sampled_from("abc"), st.integers(-1, 2))), max_size=40),
)
def test_every_packet_leaves_a_queue_once(name, drop, limit, doings):
    queue, left, pushed = DISCIPLINES[name](limit, drop), [], 0
    for doing in doings:
        if doing == "pop":
            if len(queue):
                left.append(queue.pop().number)
            continue
        gone = queue.push(Item(pushed, *doing))
        pushed += 1
        if gone:
            left.append(gone[0].number)
        assert not limit or len(queue) <= limit
        assert len(list(queue)) == len(queue) == pushed - len(left)
    assert sorted(left + emptied(queue)) == list(range(pushed))
