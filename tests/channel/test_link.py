"""One direction of the link: closed forms, conservation, order, no time travel."""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass, field

import pytest
import simpy
from hypothesis import example, given, settings
from hypothesis import strategies as st

from teleop_sim.channel.link import Direction, DirectionSettings, LinkClosed
from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import Blackout, PacketEnded, Record

# Times stay below 1e4 s, where a double resolves 2e-12 s; a packet's times are sums of some tens of such numbers.
TOLERANCE_S = 1e-9


@dataclass
class Heard:
    """What came out of a direction, and the records it wrote."""

    arrived: list[tuple[float, bytes]] = field(default_factory=list)
    records: list[Record] = field(default_factory=list)
    link: Direction | None = None

    @property
    def packets(self) -> list[PacketEnded]:
        return [r for r in self.records if isinstance(r, PacketEnded)]


def traffic(link_settings, sends, until_s):
    """Send ``(t_s, payload)`` in order over one direction; close it at the end."""
    env = simpy.Environment()
    heard = Heard()
    link = heard.link = Direction(
        env, "up", link_settings, lambda data: heard.arrived.append((env.now, data)), heard.records.append
    )

    def sender():
        for t_s, payload in sends:
            yield env.timeout(t_s - env.now)
            link.send("chat", payload, text="said")

    env.process(sender())
    env.run(until=until_s)
    link.close()
    return heard


def test_an_18_byte_command_at_64_bit_s_and_10_s_arrives_after_12_25_s():
    # 18 * 8 / 64 = 2.25 s; the row "/MANUAL_EXECUTION" of WPI's commands.
    heard = traffic(DirectionSettings(64.0, 10.0), [(0.0, b"x" * 18)], 100.0)
    assert heard.arrived == [(12.25, b"x" * 18)]


def test_headers_are_charged():
    # 18 + 40 bytes at 64 bit/s: 7.25 s.
    (packet,) = traffic(DirectionSettings(64.0, 10.0, header_bytes=40), [(1.0, b"x" * 18)], 100.0).packets
    assert (packet.sent_s, packet.service_s, packet.arrived_s) == (1.0, 1.0, 18.25)
    assert (packet.payload_bytes, packet.size_bits) == (18, 464)
    assert (packet.queue_s, packet.blackout_s, packet.serialisation_s, packet.propagation_s) == (0.0, 0.0, 7.25, 10.0)
    assert (packet.outcome, packet.reason, packet.text) == ("delivered", "", "said")


def test_back_to_back_packets_queue_and_overlap_in_flight():
    heard = traffic(DirectionSettings(8.0, 10.0), [(0.0, b"ab")] * 3, 100.0)
    assert [t for t, _ in heard.arrived] == [12.0, 14.0, 16.0]
    assert [p.queue_s for p in heard.packets] == [0.0, 2.0, 4.0]


def test_a_blackout_in_the_middle_pauses_serialisation_and_spares_what_is_in_flight():
    # 8 bit/s, 4 bytes each: the first is out at 4 s, before the dark; the second is half out at 6 s.
    link = DirectionSettings(8.0, 10.0, blackouts=((6.0, 20.0),))
    heard = traffic(link, [(0.0, b"abcd"), (0.0, b"efgh"), (0.0, b"ijkl"), (10.0, b"m")], 100.0)
    assert [t for t, _ in heard.arrived] == [14.0, 32.0, 36.0, 37.0]
    assert [p.service_s for p in heard.packets] == [0.0, 4.0, 22.0, 26.0]
    assert [p.queue_s for p in heard.packets] == [0.0, 4.0, 8.0, 6.0]
    # All dark time between offered and last bit out is the blackout's, also when others were ahead.
    assert [p.blackout_s for p in heard.packets] == [0.0, 14.0, 14.0, 10.0]
    assert [r for r in heard.records if isinstance(r, Blackout)] == [
        Blackout(6.0, "up", True),
        Blackout(20.0, "up", False),
    ]


def test_a_direction_that_is_always_dark_delivers_nothing_and_does_not_hang():
    heard = traffic(DirectionSettings(380.0, 10.0, blackouts=((0.0, math.inf),)), [(1.0, b"a"), (2.0, b"b")], 1800.0)
    assert heard.arrived == []
    assert [(p.packet, p.outcome, p.blackout_s) for p in heard.packets] == [
        (0, "in_flight", 1799.0),
        (1, "in_flight", 1798.0),
    ]
    assert all(math.isnan(p.service_s) and math.isnan(p.arrived_s) for p in heard.packets)
    assert heard.records[0] == Blackout(0.0, "up", True)


def test_nothing_keeps_the_clock_alive_after_the_last_packet_and_blackout():
    env = simpy.Environment()
    arrived: list[bytes] = []
    link_settings = DirectionSettings(8.0, 1.0, blackouts=((3.0, 5.0), (9.0, math.inf)))
    link = Direction(env, "down", link_settings, lambda data: arrived.append(data), lambda _: None)
    link.send("log", b"12345")
    link.send("log", b"never" * 9)
    env.run()
    assert (arrived, env.now, link.in_flight) == ([b"12345"], 9.0, 1)


def test_closing_ends_queued_served_and_propagating_packets_in_order():
    # At 9 s: packet 0 is in the air since 4 s, packet 1 is half out, packet 2 waits.
    link = DirectionSettings(8.0, 10.0, blackouts=((5.0, 7.0),))
    heard = traffic(link, [(0.0, b"abcd"), (0.0, b"efgh"), (0.0, b"ijkl")], 9.0)
    assert [p.packet for p in heard.packets] == [0, 1, 2]
    assert {p.outcome for p in heard.packets} == {"in_flight"}
    waits = [(p.queue_s, p.blackout_s, p.serialisation_s, p.propagation_s) for p in heard.packets]
    assert waits == [(0.0, 0.0, 4.0, 5.0), (4.0, 2.0, 3.0, 0.0), (7.0, 2.0, 0.0, 0.0)]
    assert heard.packets[1].service_s == 4.0
    assert math.isnan(heard.packets[2].service_s)


def test_closing_twice_writes_once_and_a_later_packet_is_refused():
    heard = traffic(DirectionSettings(8.0, 10.0), [(0.0, b"abcd")], 1.0)
    heard.link.close()
    assert len(heard.packets) == 1
    with pytest.raises(LinkClosed, match="after close"):
        heard.link.send("chat", b"late")


def test_utilisation_is_the_share_of_time_in_which_bits_go_out():
    # By 9 s bits went out from 0 to 5 and from 7 to 9.
    link = DirectionSettings(8.0, 1.0, blackouts=((5.0, 7.0),))
    heard = traffic(link, [(0.0, b"aa"), (0.0, b"a" * 20)], 9.0)
    assert heard.link.utilisation() == pytest.approx(7.0 / 9.0, abs=TOLERANCE_S)


def test_utilisation_does_not_wait_for_the_packet_to_end():
    env = simpy.Environment()
    link = Direction(env, "up", DirectionSettings(8.0, 1.0), lambda _: None, lambda _: None)
    assert link.utilisation() == 0.0
    link.send("chat", b"a" * 20)
    env.run(until=9.0)
    assert link.utilisation() == 1.0


sizes = st.integers(0, 300)
gaps = st.one_of(st.just(0.0), st.floats(0.0, 50.0))


@st.composite
def blackout_schedules(draw):
    t, windows = 0.0, []
    for gap, length in draw(st.lists(st.tuples(st.floats(0.0, 80.0), st.floats(0.01, 80.0)), max_size=6)):
        start = t + gap
        windows.append((start, start + length))
        t = start + length
    if windows and draw(st.booleans()):
        windows[-1] = (windows[-1][0], math.inf)
    return tuple(windows)


@st.composite
def links(draw):
    return DirectionSettings(
        rate_bps=draw(st.one_of(st.floats(8.0, 1e6), st.just(math.inf))),
        delay_s=draw(st.one_of(st.just(0.0), st.floats(0.0, 30.0))),
        header_bytes=draw(st.sampled_from((0, 28, 40))),
        blackouts=draw(blackout_schedules()),
    )


DARK_AT_THE_END = ((0.37503543095954944, 34.37503543095955), (34.37503543095955, 35.37503543095955))
"""Held a packet until after the end: the share of time in use came out at -2e-16."""


@settings(max_examples=400, deadline=None)
@example(DirectionSettings(rate_bps=math.inf, delay_s=0.0, blackouts=DARK_AT_THE_END), [(1.6160764790020998, 0)], 35.0)
@given(links(), st.lists(st.tuples(gaps, sizes), max_size=25), st.floats(1.0, 400.0))
def test_conservation_order_and_no_time_travel(link, pattern, until_s):
    sends, t = [], 0.0
    for i, (gap, size) in enumerate(pattern):
        t += gap
        sends.append((t, bytes([i]) + b"." * size))
    heard = traffic(link, sends, until_s)
    packets, delivered = heard.packets, [p for p in heard.packets if p.outcome == "delivered"]

    # Conservation: every packet offered ends exactly once, and what arrives is what was sent, in order.
    offered = [payload for t_s, payload in sends if t_s < until_s]
    assert heard.link.sent == len(packets) >= len(offered)
    assert heard.link.sent == heard.link.delivered + heard.link.dropped + sum(p.outcome == "in_flight" for p in packets)
    assert [p.packet for p in packets] == list(range(len(packets)))
    assert [data for _, data in heard.arrived] == [payload for _, payload in sends][: len(delivered)]

    # No time travel: never faster than light and rate allow, never out in the dark.
    for p in delivered:
        assert p.arrived_s - p.sent_s >= p.size_bits / link.rate_bps + link.delay_s - TOLERANCE_S
        assert not any(start <= p.service_s < end for start, end in link.blackouts)
    times = [r.t_s for r in heard.records]
    assert times == sorted(times)

    # The waits explain the whole time, and none is negative.
    for p in packets:
        waits = (p.queue_s, p.blackout_s, p.serialisation_s, p.propagation_s)
        until = p.arrived_s if p.outcome == "delivered" else p.t_s
        assert sum(waits) == pytest.approx(until - p.sent_s, abs=TOLERANCE_S)
        assert min(waits) >= -TOLERANCE_S
    assert 0.0 <= heard.link.utilisation() <= 1.0 + TOLERANCE_S


@settings(max_examples=100, deadline=None)
@given(links(), st.lists(st.tuples(gaps, sizes), max_size=15))
def test_the_same_traffic_gives_the_same_records(link, pattern):
    sends, t = [], 0.0
    for gap, size in pattern:
        t += gap
        sends.append((t, b"." * size))
    first, again = (traffic(link, sends, 300.0).records for _ in range(2))
    assert repr(first) == repr(again)  # repr, because NaN is unlike itself


def test_one_event_a_packet():
    env = simpy.Environment()
    link = Direction(env, "up", DirectionSettings(1e6, 5.0), lambda _: None, lambda _: None)
    for _ in range(1000):
        link.send("chat", b"x")
    events = 0
    while env.peek() < math.inf:
        env.step()
        events += 1
    assert (events, link.delivered) == (1000, 1000)


def test_bad_settings_are_refused_with_every_problem():
    with pytest.raises(BadInput) as refused:
        DirectionSettings(0.0, -1.0, -3, ((5.0, 2.0), (1.0, 3.0)))
    where = [p.where for p in refused.value.problems]
    assert where == ["rate_bps", "delay_s", "header_bytes", "blackouts[0]", "blackouts[1]"]
    assert pickle.loads(pickle.dumps(refused.value)).args == refused.value.args
    assert "delivers nothing" in str(refused.value)


@pytest.mark.parametrize("rate_bps", [0.0, -1.0, math.nan])
def test_a_rate_that_delivers_nothing_is_named(rate_bps):
    with pytest.raises(BadInput) as refused:
        DirectionSettings(rate_bps, 0.0)
    assert [p.where for p in refused.value.problems] == ["rate_bps"]


@pytest.mark.parametrize("delay_s", [-1.0, math.inf, math.nan])
def test_an_impossible_delay_is_named(delay_s):
    with pytest.raises(BadInput) as refused:
        DirectionSettings(8.0, delay_s)
    assert [p.where for p in refused.value.problems] == ["delay_s"]
