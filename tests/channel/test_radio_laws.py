"""Laws of every direction over random settings and traffic, and the two engines against each other."""

from __future__ import annotations

import itertools
import math
import tracemalloc
from collections import Counter
from dataclasses import astuple, replace

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.counters import WAITS
from teleop_sim.channel.drops import DROP_REASONS
from teleop_sim.channel.jitter import EmpiricalJitter, NoJitter, NormalJitter, UniformJitter
from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import Bernoulli, GilbertElliott, NoLoss
from teleop_sim.channel.radio import Radio
from teleop_sim.channel.rates import finish_of
from teleop_sim.core.records import PacketEnded

# Times stay below 2e3 s, where a double resolves 2e-13 s; a packet's times are sums of some hundreds of such numbers.
TOLERANCE_S = 1e-9


@st.composite
def schedules(draw):
    """Up to five blackouts to the millisecond; the last may never end."""
    gaps = draw(st.lists(st.tuples(st.integers(0, 60_000), st.integers(10, 60_000)), max_size=5))
    edges = [ms / 1000 for ms in itertools.accumulate(itertools.chain.from_iterable(gaps))]
    windows = list(zip(edges[::2], edges[1::2], strict=True))
    if windows and draw(st.booleans()):
        windows[-1] = (windows[-1][0], math.inf)
    return tuple(windows)


@st.composite
def rate_schedules(draw):
    steps = draw(st.lists(st.tuples(st.floats(0.5, 50.0), st.floats(8.0, 1e5) | st.just(math.inf)), max_size=4))
    starts = (0.0, *itertools.accumulate(step for step, _ in steps))
    return tuple(zip(starts, (rate for _, rate in steps), strict=False))


plain = st.builds(
    DirectionSettings,
    rate_bps=st.floats(8.0, 1e6) | st.just(math.inf),
    delay_s=st.just(0.0) | st.floats(0.0, 30.0),
    header_bytes=st.sampled_from((0, 28, 40)),
    blackouts=schedules(),
)
changes = st.fixed_dictionaries(
    {},
    optional={
        "rates": rate_schedules(),
        "jitter": st.sampled_from((NoJitter(), UniformJitter(0.0, 20.0), EmpiricalJitter((0.0, 0.5, 9.0)))),
        "reorder": st.booleans(),
        "loss": st.sampled_from((NoLoss(), Bernoulli(0.3), GilbertElliott(0.2, 0.3, 0.9))),
        "on_dark": st.sampled_from(("pause", "restart", "lose")),
        "on_dark_flight": st.sampled_from(("arrive", "lose")),
        "queue_limit": st.integers(0, 4),
        "discipline": st.sampled_from(("fifo", "priority", "newest")),
        "drop": st.sampled_from(("tail", "head")),
        "budget_bits": st.sampled_from((math.inf, 4000.0, 9001.0)),
        "mtu_bytes": st.sampled_from((0, 41, 64, 200)),
    },
)
links = st.builds(lambda of, more: replace(of, **more), plain, changes)
gaps = st.just(0.0) | st.floats(0.0, 40.0)
patterns = st.lists(st.tuples(gaps, st.integers(0, 300), st.integers(0, 2), st.sampled_from("abc")), max_size=25)
ends = st.floats(1.0, 400.0)


def play(make, link_settings, pattern, until_s):
    """Records, arrivals ``(t_s, payload)`` and the direction, closed. Payloads are told apart by their first byte."""
    env = simpy.Environment()
    records, arrived = [], []
    link = make(env, "up", link_settings, lambda data: arrived.append((env.now, data)), records.append)

    def sender():
        for i, (gap_s, size, priority, topic) in enumerate(pattern):
            yield env.timeout(gap_s)
            link.send(topic, bytes([i]) + b"." * size, "", priority)

    env.process(sender())
    env.run(until=until_s)
    assert link.in_flight == link.sent - len([r for r in records if isinstance(r, PacketEnded)])
    link.close()
    return records, arrived, link


def directions(seed):
    return lambda *args: Direction(*args, rng=np.random.default_rng(seed))


def radios(*args):
    return Radio(*args, rng=None)


def ended(records):
    return sorted((r for r in records if isinstance(r, PacketEnded)), key=lambda p: p.packet)


@settings(max_examples=1300, deadline=None)
@given(links, patterns, ends, st.integers(0, 9))
def test_every_packet_ends_once_and_nothing_travels_in_time(link_settings, pattern, until_s, seed):
    records, arrived, link = play(directions(seed), link_settings, pattern, until_s)
    packets = ended(records)
    delivered = [p for p in packets if p.outcome == "delivered"]
    rates = link_settings.rates or ((0.0, link_settings.rate_bps),)

    # Conservation: each offered packet has one record, in the counts too, and payloads are not made up.
    assert [p.packet for p in packets] == list(range(link.sent))
    reasons = Counter(p.reason for p in packets if p.outcome == "dropped")
    assert link.counters.total.dropped == dict(reasons)
    assert set(reasons) <= set(DROP_REASONS)
    assert link.sent == link.delivered + link.dropped + sum(p.outcome == "in_flight" for p in packets)
    assert link.counters.total.offered == link.sent
    assert link.delivered == len(delivered) == len(arrived)
    assert sorted(data[0] for _, data in arrived) == [p.packet for p in delivered]
    assert all(len(data) == pattern[data[0]][1] + 1 for _, data in arrived)

    # No time travel: records in order, no first bit in the dark, no bits faster than rates, light and delay.
    times = [r.t_s for r in records]
    assert times == sorted(times)
    for p in packets:
        assert not any(dark_s <= p.service_s < light_s for dark_s, light_s in link_settings.blackouts)
    for p in delivered:
        out_s = p.arrived_s - p.propagation_s
        assert out_s >= finish_of(p.sent_s, p.size_bits, rates, link_settings.blackouts) - TOLERANCE_S
        assert p.propagation_s >= link_settings.delay_s + link_settings.jitter.least_s - TOLERANCE_S

    # The waits explain the whole time, and none is negative.
    for p in packets:
        five = [getattr(p, wait) for wait in WAITS]
        assert min(five) >= -TOLERANCE_S
        assert math.fsum(five) == pytest.approx(p.t_s - p.sent_s, rel=0, abs=TOLERANCE_S)

    # The air keeps the order in which last bits went out, unless it may not.
    if not link_settings.reorder:
        by_number = {p.packet: p for p in delivered}
        out = [by_number[data[0]].arrived_s - by_number[data[0]].propagation_s for _, data in arrived]
        assert all(b >= a - TOLERANCE_S for a, b in itertools.pairwise(out))
        if link_settings.discipline == "fifo":
            assert [data[0] for _, data in arrived] == [p.packet for p in delivered]

    # The budget holds for what went out.
    begun_bits = sum(p.size_bits for p in packets if not math.isnan(p.service_s))
    assert begun_bits <= link_settings.budget_bits


@settings(max_examples=200, deadline=None)
@given(links, patterns, ends, st.integers(0, 9))
def test_the_same_seed_gives_the_same_records(link_settings, pattern, until_s, seed):
    one, two = (repr(play(directions(seed), link_settings, pattern, until_s)[0]) for _ in range(2))
    assert one == two


@settings(max_examples=500, deadline=None)
@given(plain, patterns, ends)
def test_the_two_engines_agree(link_settings, pattern, until_s):
    assert link_settings.neutral
    planned, _, fast = play(directions(0), link_settings, pattern, until_s)
    stepped, _, slow = play(radios, link_settings, pattern, until_s)
    for one, two in zip(ended(planned), ended(stepped), strict=True):
        if abs(one.service_s - until_s) <= TOLERANCE_S:
            # A first bit at the very end: the plan has it, the clock has stopped.
            one, two = replace(one, service_s=0.0), replace(two, service_s=0.0)
        for a, b in zip(astuple(one), astuple(two), strict=True):
            assert a == (pytest.approx(b, rel=0, abs=TOLERANCE_S, nan_ok=True) if isinstance(a, float) else b)
    assert fast.utilisation() == pytest.approx(slow.utilisation(), abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(plain, patterns, ends)
def test_settings_that_change_nothing_change_nothing(link_settings, pattern, until_s):
    # A limit and a budget that are never reached, the one rate twice, a jitter of nothing, priorities all alike,
    # fragments without headers.
    raw = replace(link_settings, header_bytes=0)
    rates = ((0.0, raw.rate_bps), (7.7, raw.rate_bps))
    more = {"queue_limit": 99, "budget_bits": 1e9, "jitter": NormalJitter(0.0, 0.0), "discipline": "priority"}
    idle = replace(raw, rates=rates, mtu_bytes=50, **more)
    alike = [(gap_s, size, 1, topic) for gap_s, size, _, topic in pattern]
    plain_records, wide_records = (ended(play(directions(0), s, alike, until_s)[0]) for s in (raw, idle))
    for one, two in zip(plain_records, wide_records, strict=True):
        assert one.outcome == two.outcome
        assert one.arrived_s == pytest.approx(two.arrived_s, rel=0, abs=TOLERANCE_S, nan_ok=True)


@settings(max_examples=200, deadline=None)
@given(plain, patterns, st.integers(0, 24), st.sampled_from((0, 41, 64, 200)), st.sampled_from(("pause", "restart")))
def test_the_most_urgent_waits_for_one_fragment_at_most(link_settings, pattern, which, mtu_bytes, on_dark):
    link_settings = replace(link_settings, discipline="priority", mtu_bytes=mtu_bytes, on_dark=on_dark)
    pattern = [(gap_s, size, 9 if i == which else p, topic) for i, (gap_s, size, p, topic) in enumerate(pattern)]
    longest_bits = 8 * (mtu_bytes or 301 + link_settings.header_bytes)
    for p in ended(play(directions(0), link_settings, pattern, 2000.0)[0]):
        if p.priority == 9:
            assert p.queue_s <= longest_bits / link_settings.rate_bps + TOLERANCE_S


@settings(max_examples=200, deadline=None)
@given(plain, patterns)
def test_the_newest_state_of_a_topic_is_never_superseded(link_settings, pattern):
    packets = ended(play(directions(0), replace(link_settings, discipline="newest"), pattern, 2000.0)[0])
    last = {p.topic: p for p in packets}
    assert all(p.outcome != "dropped" for p in last.values())
    assert {p.reason for p in packets if p.outcome == "dropped"} <= {"superseded"}
    # What is superseded never began, and ends when a newer one of its topic is sent.
    for p in packets:
        if p.outcome == "dropped":
            assert math.isnan(p.service_s)
            assert p.t_s in {q.sent_s for q in packets if q.topic == p.topic and q.packet > p.packet}


@pytest.mark.parametrize("more", [{}, {"jitter": UniformJitter(0.0, 0.1), "loss": Bernoulli(0.1), "queue_limit": 5}])
def test_memory_does_not_grow_with_packets(more):
    def left_bytes(count):
        env = simpy.Environment()
        link_settings = DirectionSettings(8000.0, 0.1, **more)
        link = Direction(env, "up", link_settings, lambda _: None, lambda _: None, np.random.default_rng(1))

        def sender():
            for _ in range(count):
                link.send("chat", b"x")
                yield env.timeout(0.01)

        env.process(sender())
        tracemalloc.start()
        env.run()
        left, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert link.sent == count
        return left

    # A packet kept would be 64 bytes or more each: 128,000. What is left is the counters and the clock.
    assert left_bytes(3000) - left_bytes(1000) < 10_000


def test_memory_is_one_entry_a_topic():
    _, _, link = play(
        directions(0), DirectionSettings(math.inf, 0.0), [(0.0, 1, 0, "ab"[i % 2]) for i in range(99)], 9.0
    )
    assert {topic: c.delivered for topic, c in link.counters.by_topic.items()} == {"a": 50, "b": 49}
    assert link.counters.total.delivered_bits == link.delivered_bits == 99 * 16
