"""What holds for every link and every traffic: conservation, order, no time travel, waits that add up, no growth."""

from __future__ import annotations

import math
import tracemalloc
from collections import Counter
from dataclasses import dataclass, field

import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.core.records import PacketEnded

# Times stay below 1e4 s, where a double resolves 2e-12 s; a packet's times are sums of some tens of such numbers.
TOLERANCE_S = 1e-9


@dataclass
class Run:
    """A direction after its run, what its receiver got and when, and its packet records."""

    link: Direction
    until_s: float
    offered: list[bytes] = field(default_factory=list)
    arrived: list[tuple[float, bytes]] = field(default_factory=list)
    packets: list[PacketEnded] = field(default_factory=list)

    @property
    def delivered(self) -> list[PacketEnded]:
        return [p for p in self.packets if p.outcome == "delivered"]


def run(link_settings, traffic, until_s):
    """Offer ``(gap_s, bytes)`` one after the other; close the link at ``until_s``. Every payload is another one."""
    env = simpy.Environment()

    def keep(record):
        if isinstance(record, PacketEnded):
            done.packets.append(record)

    link = Direction(env, "up", link_settings, lambda data: done.arrived.append((env.now, data)), keep)
    done = Run(link, until_s)

    def sender():
        for i, (gap_s, size) in enumerate(traffic):
            yield env.timeout(gap_s)
            done.offered.append(i.to_bytes(2, "big") + b"." * size)
            link.send("chat", done.offered[-1])

    env.process(sender())
    env.run(until=until_s)
    link.close()
    return done


def assert_conserved(done):
    """sent = delivered + dropped + in flight, packet by packet; the receiver got those delivered and nothing else."""
    link, ends = done.link, Counter(p.outcome for p in done.packets)
    assert set(ends) <= {"delivered", "dropped", "in_flight"}
    assert link.sent == len(done.offered) == len(done.packets) == len({p.packet for p in done.packets})
    assert (link.delivered, link.dropped) == (ends["delivered"], ends["dropped"])
    assert link.sent == link.delivered + link.dropped + ends["in_flight"]
    assert all(bool(p.reason) == (p.outcome == "dropped") for p in done.packets)
    assert [data for _, data in done.arrived] == [done.offered[p.packet] for p in done.delivered]
    assert [t_s for t_s, _ in done.arrived] == [p.arrived_s for p in done.delivered]


def assert_no_time_travel(done, fastest_bps, least_delay_s):
    """Nothing comes before its bits at the best rate and the least delay allow, or after the end, or from the dark."""
    for p in done.packets:
        assert p.sent_s <= p.t_s <= done.until_s
        assert p.outcome == "delivered" or math.isnan(p.arrived_s)
        assert math.isnan(p.service_s) or p.service_s >= p.sent_s
        assert not any(start_s <= p.service_s < end_s for start_s, end_s in done.link.settings.blackouts)
    for p in done.delivered:
        assert p.arrived_s - p.service_s >= p.size_bits / fastest_bps + least_delay_s - TOLERANCE_S
    assert [p.t_s for p in done.packets] == sorted(p.t_s for p in done.packets)


def assert_waits_add_up(done):
    """The waits explain all the time from offer to end; none is negative."""
    for p in done.packets:
        waits = (p.queue_s, p.blackout_s, p.serialisation_s, p.propagation_s)
        assert sum(waits) == pytest.approx(p.t_s - p.sent_s, rel=0, abs=TOLERANCE_S)
        assert min(waits) >= -TOLERANCE_S
    assert 0.0 <= done.link.utilisation() <= 1.0 + TOLERANCE_S


def windows(spells):
    """Blackouts from spells of light and dark in turn, ``(light_s, dark_s)``."""
    t_s, found = 0.0, []
    for light_s, dark_s in spells:
        found.append((t_s + light_s, t_s + light_s + dark_s))
        t_s = found[-1][1]
    return tuple(found)


blackouts = st.lists(st.tuples(st.floats(0.0, 80.0), st.floats(0.01, 80.0)), max_size=5).map(windows)
gaps = st.one_of(st.just(0.0), st.floats(0.0, 50.0))
traffics = st.lists(st.tuples(gaps, st.integers(0, 300)), max_size=25)
ends = st.floats(1.0, 600.0)
plain_links = st.builds(
    DirectionSettings,
    rate_bps=st.one_of(st.floats(8.0, 1e6), st.just(math.inf)),
    delay_s=st.one_of(st.just(0.0), st.floats(0.0, 30.0)),
    header_bytes=st.sampled_from((0, 28, 40)),
    blackouts=blackouts,
)


@settings(max_examples=1000, deadline=None)
@given(plain_links, traffics, ends)
def test_a_plain_link_conserves_packets_keeps_their_order_and_never_hurries(link_settings, traffic, until_s):
    done = run(link_settings, traffic, until_s)
    assert_conserved(done)
    assert_no_time_travel(done, link_settings.rate_bps, link_settings.delay_s)
    assert_waits_add_up(done)
    assert [p.packet for p in done.packets] == list(range(len(done.packets)))
    assert done.link.dropped == 0


def kept_bytes(counts, gap_s):
    """Bytes of Python memory in use after so many packets of one run, one packet each ``gap_s``."""
    env = simpy.Environment()
    link = Direction(env, "down", DirectionSettings(8000.0, 1.0), lambda _: None, lambda _: None)

    def sender():
        while True:
            yield env.timeout(gap_s)
            link.send("log", b"." * 10)

    env.process(sender())
    kept = []
    tracemalloc.start()
    try:
        for count in counts:
            env.run(until=(count + 0.5) * gap_s)
            kept.append(tracemalloc.get_traced_memory()[0])
            assert link.delivered > 0.99 * count
    finally:
        tracemalloc.stop()
    return kept


def test_memory_does_not_grow_with_the_packets_delivered():
    at_first, later = kept_bytes((100_000, 200_000), 0.0125)
    # One reference kept a packet would be 8 bytes, 800,000 in all; counters that grow to larger whole numbers, and what
    # Python keeps for itself, stay below a hundredth of that.
    assert later - at_first < 8_000
