"""The same traffic through ns.py 0.4.3, a network simulator that others wrote (https://github.com/TL-System/ns.py).

Its ``Port`` (FIFO at a rate) and ``Wire`` (a delay) in a row are our ``Direction`` without blackouts. Both use SimPy's
clock, and nothing else in common. ns.py computes an arrival from other sums of the same numbers, so 1e-6 s is far above
rounding and far below a bit's time.
"""

from __future__ import annotations

import numpy as np
import pytest
import simpy

from teleop_sim.channel.link import Direction, DirectionSettings

pytest.importorskip("ns", reason="ns.py is in the test extra")

CASES = 100
TOLERANCE_S = 1e-6


def case(number):
    """A random link and traffic that is sparse, busy or far too much; every fourth comes in bursts at one instant."""
    rng = np.random.default_rng([20261122, number])
    rate_bps, delay_s = 10.0 ** rng.uniform(1.0, 7.0), float(rng.choice([0.0, rng.uniform(0.0, 1300.0)]))
    header_bytes, count = int(rng.integers(0, 60)), int(rng.integers(1, 150))
    sizes = rng.integers(1, 1500, count)
    gaps_s = rng.exponential(8.0 * 780.0 / rate_bps / rng.choice([0.2, 0.9, 5.0]), count)
    if number % 4 == 0:
        gaps_s[rng.random(count) < 0.7] = 0.0
    return DirectionSettings(rate_bps, delay_s, header_bytes), gaps_s.tolist(), sizes.tolist()


def send_all(env, gaps_s, sizes, send):
    for gap_s, size in zip(gaps_s, sizes, strict=True):
        yield env.timeout(gap_s)
        send(size)


def our_arrivals(link_settings, gaps_s, sizes):
    """(packet, time [s]) in order of arrival, as the receiver was told."""
    env, arrived = simpy.Environment(), []
    numbers = []
    link = Direction(
        env, "up", link_settings, lambda _: arrived.append(env.now), lambda record: numbers.append(record.packet)
    )
    env.process(send_all(env, gaps_s, sizes, lambda size: link.send("chat", b"." * size)))
    env.run()
    return list(zip(numbers, arrived, strict=True))


def their_arrivals(link_settings, gaps_s, sizes):
    """The same from ns.py."""
    from ns.packet.packet import Packet
    from ns.port.port import Port
    from ns.port.wire import Wire

    class Sink:
        def put(self, packet):
            arrived.append((packet.packet_id, env.now))

    env, arrived, numbers = simpy.Environment(), [], iter(range(len(sizes)))
    port, wire = Port(env, link_settings.rate_bps), Wire(env, lambda: link_settings.delay_s)
    port.out, wire.out = wire, Sink()
    charged = link_settings.header_bytes
    env.process(send_all(env, gaps_s, sizes, lambda size: port.put(Packet(env.now, size + charged, next(numbers)))))
    env.run()
    return arrived


@pytest.mark.parametrize("number", range(CASES))
def test_ns_py_delivers_the_same_packets_at_the_same_times(number):
    ours, theirs = our_arrivals(*case(number)), their_arrivals(*case(number))
    assert [packet for packet, _ in ours] == [packet for packet, _ in theirs]
    assert [t_s for _, t_s in ours] == pytest.approx([t_s for _, t_s in theirs], rel=0, abs=TOLERANCE_S)
