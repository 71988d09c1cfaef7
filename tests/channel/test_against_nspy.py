"""The same traffic through ns.py 0.4.3, a network simulator that others wrote (https://github.com/TL-System/ns.py).

Its ``Port`` (FIFO at a rate, room for so many) or ``SPServer`` (strict priority, whole packets) and behind it its
``Wire`` (a delay) are our ``Direction`` without blackouts. Both use SimPy's clock, and nothing else in common. ns.py
computes an arrival from other sums of the same numbers: the two differ by rounding, up to 2.3e-13 s in these cases.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import count

import numpy as np
import pytest
import simpy
from ns.packet.packet import Packet
from ns.port.port import Port
from ns.port.wire import Wire
from ns.scheduler.sp import SPServer

from teleop_sim.channel.link import Direction, DirectionSettings

CASES = 100
PRIORITIES = 3
TOLERANCE_S = 1e-6


def case(number):
    """A random link and traffic that is sparse, busy or far too much; every fourth comes in bursts at one instant."""
    rng = np.random.default_rng([20261122, number])
    rate_bps, delay_s = 10.0 ** rng.uniform(1.0, 7.0), float(rng.choice([0.0, rng.uniform(0.0, 1300.0)]))
    header_bytes, packets = int(rng.integers(0, 60)), int(rng.integers(1, 150))
    sizes = rng.integers(1, 1500, packets)
    gaps_s = rng.exponential(8.0 * 780.0 / rate_bps / rng.choice([0.2, 0.9, 5.0]), packets)
    if number % 4 == 0:
        gaps_s[rng.random(packets) < 0.7] = 0.0
    return DirectionSettings(rate_bps, delay_s, header_bytes), gaps_s.tolist(), sizes.tolist()


def send_all(env, gaps_s, sizes, send):
    for gap_s, size in zip(gaps_s, sizes, strict=True):
        yield env.timeout(gap_s)
        send(size)


def our_arrivals(link_settings, gaps_s, sizes):
    """(packet, time [s]) of those delivered, in order of arrival; priorities go round: 0, 1, 2, 0, ..."""
    env, arrived = simpy.Environment(), []

    def keep(record):
        if record.outcome == "delivered":
            arrived.append((record.packet, env.now))

    link = Direction(env, "up", link_settings, lambda _: None, keep)
    numbers = count()

    def send(size):
        link.send("chat", b"." * size, "", next(numbers) % PRIORITIES)

    env.process(send_all(env, gaps_s, sizes, send))
    env.run()
    return arrived


def their_arrivals(link_settings, gaps_s, sizes, radio):
    """The same from ns.py; ``radio`` makes its element that has the rate."""

    class Sink:
        def put(self, packet):
            arrived.append((packet.packet_id, env.now))

    env, arrived, numbers = simpy.Environment(), [], count()
    front, wire = radio(env, link_settings), Wire(env, lambda: link_settings.delay_s)
    front.out, wire.out = wire, Sink()

    def send(size):
        number = next(numbers)
        front.put(Packet(env.now, size + link_settings.header_bytes, number, flow_id=number % PRIORITIES))

    env.process(send_all(env, gaps_s, sizes, send))
    env.run()
    return arrived


def assert_agree(traffic, radio):
    ours, theirs = our_arrivals(*traffic), their_arrivals(*traffic, radio)
    assert [packet for packet, _ in ours] == [packet for packet, _ in theirs]
    assert [t_s for _, t_s in ours] == pytest.approx([t_s for _, t_s in theirs], rel=0, abs=TOLERANCE_S)
    return len(ours)


@pytest.mark.parametrize("number", range(CASES))
def test_fifo_rate_and_delay_are_ns_py_s(number):
    traffic = case(number)
    assert assert_agree(traffic, lambda env, link: Port(env, link.rate_bps)) == len(traffic[1])


# No bursts below: who of one instant is first is a rule of ours and an accident there.
@pytest.mark.parametrize("number", [n for n in range(CASES) if n % 4])
def test_strict_priority_is_ns_py_s(number):
    link_settings, gaps_s, sizes = case(number)
    link_settings = replace(link_settings, discipline="priority")
    found = assert_agree(
        (link_settings, gaps_s, sizes), lambda env, link: SPServer(env, link.rate_bps, list(range(PRIORITIES)))
    )
    assert found == len(sizes)


@pytest.mark.parametrize("number", [n for n in range(CASES) if n % 4])
def test_a_bounded_queue_keeps_and_drops_what_ns_py_s_does(number):
    link_settings, gaps_s, sizes = case(number)
    link_settings = replace(link_settings, queue_limit=1 + number % 7)
    # Its limit counts the packet under way too.
    assert_agree((link_settings, gaps_s, sizes), lambda env, link: Port(env, link.rate_bps, link.queue_limit + 1))
