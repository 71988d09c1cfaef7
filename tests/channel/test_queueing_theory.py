"""One direction against closed forms and queueing theory, which know nothing of our code.

Sources: L. Kleinrock, Queueing Systems, vol. 1 (Wiley, 1975), ch. 3 (M/M/1 with bounded room), ch. 5 (mean wait of
Pollaczek and Khinchine) and ch. 8 (the recursion of D. V. Lindley, Proc. Camb. Phil. Soc. 48 (1952) 277-289).
Priorities: A. Cobham, Oper. Res. 2 (1954) 70-76. How many packets a mean of correlated waits needs: D. J. Daley, J.
Austral. Math. Soc. 8 (1968) 683-699; his figure for M/M/1 agrees with the batch means found here.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.core.records import PacketEnded

# Times stay below 1e4 s, where a double resolves 2e-12 s; a packet's times are sums of some tens of such numbers.
TOLERANCE_S = 1e-9


def burst(link_settings, sizes):
    """Offer payloads of ``sizes`` bytes at time zero and run till all is still; the records in order of arrival."""
    env, records = simpy.Environment(), []
    link = Direction(env, "up", link_settings, lambda _: None, records.append)
    for size in sizes:
        link.send("chat", b"." * size)
    env.run()
    link.close()
    return [r for r in records if isinstance(r, PacketEnded)]


rates = st.floats(8.0, 1e7)
delays = st.floats(0.0, 1300.0)  # Mars at its farthest: 22 minutes.
headers = st.integers(0, 60)


@given(rates, delays, headers, st.integers(1, 1000))
def test_on_an_idle_link_a_packet_takes_bits_over_rate_plus_delay(rate_bps, delay_s, header_bytes, size):
    (packet,) = burst(DirectionSettings(rate_bps, delay_s, header_bytes), [size])
    assert packet.arrived_s == pytest.approx(8 * (size + header_bytes) / rate_bps + delay_s, rel=0, abs=TOLERANCE_S)


def test_an_18_byte_command_at_64_bit_s_and_10_s_takes_12_25_s():
    (packet,) = burst(DirectionSettings(64.0, 10.0), [18])
    assert packet.arrived_s == pytest.approx(12.25, rel=0, abs=TOLERANCE_S)


@given(rates, delays, headers, st.lists(st.integers(1, 1000), min_size=1, max_size=20))
def test_back_to_back_packets_arrive_when_all_bits_up_to_theirs_are_out(rate_bps, delay_s, header_bytes, sizes):
    packets = burst(DirectionSettings(rate_bps, delay_s, header_bytes), sizes)
    bits = np.cumsum([8 * (size + header_bytes) for size in sizes])
    assert [p.arrived_s for p in packets] == pytest.approx(list(bits / rate_bps + delay_s), rel=0, abs=TOLERANCE_S)
    ahead = bits - [p.size_bits for p in packets]
    assert [p.queue_s for p in packets] == pytest.approx(list(ahead / rate_bps), rel=0, abs=TOLERANCE_S)


def test_an_urgent_packet_goes_ahead_at_the_next_end_of_a_fragment():
    # 8 bit/s: a second a byte. 10 bytes in fragments of 3, 3, 3 and 1 and a header byte each: out at 4, 8, 12 and 14 s.
    # At 5 s come 2 urgent bytes, 3 s with their header: from 8 to 11 s, ahead of the last two fragments.
    link_settings = DirectionSettings(8.0, 10.0, 1, mtu_bytes=4, discipline="priority")
    found = figures([0.0, 5.0], [10, 2], link_settings, lambda p: (p.packet, p.arrived_s, p.queue_s), [0, 1])
    assert found == pytest.approx(np.array([[1, 21.0, 3.0], [0, 27.0, 3.0]]), rel=0, abs=TOLERANCE_S)


@given(rates, delays, st.integers(1, 50), st.integers(20, 200), st.integers(1, 20), st.floats(0.01, 0.99))
def test_preemption_waits_for_one_fragment_and_takes_no_longer_than_its_bits(rate_bps, delay_s, count, mtu, size, part):
    """When ``part`` of the middle one of ``count`` fragments is out, an urgent packet of one fragment comes."""
    piece_s, urgent_s, before = 8 * mtu / rate_bps, 8 * size / rate_bps, count // 2
    link_settings = DirectionSettings(rate_bps, delay_s, mtu_bytes=mtu, discipline="priority")
    gaps_s = [0.0, (before + part) * piece_s]
    found = figures(gaps_s, [count * mtu, size], link_settings, lambda p: (p.priority, p.arrived_s), [0, 1])
    arrived_s = dict(found)
    assert arrived_s[1] == pytest.approx((before + 1) * piece_s + urgent_s + delay_s, rel=0, abs=TOLERANCE_S)
    # In the last fragment it comes too late to hold the other up.
    held_s = urgent_s if before + 1 < count else 0.0
    assert arrived_s[0] == pytest.approx(count * piece_s + held_s + delay_s, rel=0, abs=TOLERANCE_S)


RATE_BPS, MEAN_BYTES = 8000.0, 1000
SERVICE_S = 8 * MEAN_BYTES / RATE_BPS


def figures(gaps_s, sizes_bytes, link_settings, figure, priorities=None):
    """``figure(record)`` of each packet in the order in which they end; nothing else is kept."""
    env, found = simpy.Environment(), []
    link = Direction(env, "up", link_settings, lambda _: None, lambda record: found.append(figure(record)))
    letters = b"." * max(sizes_bytes)

    def sender():
        for gap_s, size, priority in zip(gaps_s, sizes_bytes, priorities or [0] * len(gaps_s), strict=True):
            yield env.timeout(gap_s)
            link.send("chat", letters[:size], "", priority)

    env.process(sender())
    env.run()
    return np.array(found)


def waits_s(gaps_s, sizes_bytes, link_settings):
    """How long each packet stood behind others."""
    return figures(gaps_s, sizes_bytes, link_settings, lambda record: record.queue_s)


def drawn(load, count, seed, sizes):
    """Poisson arrivals at ``load``, and sizes in whole bytes, never empty: all one, or exponential."""
    rng = np.random.default_rng(seed)
    gaps_s = rng.exponential(SERVICE_S / load, count)
    if sizes == "one":
        return gaps_s, np.full(count, MEAN_BYTES)
    # Rounded to whole bytes: the second moment changes by 1/(12 * 1000^2) of the mean squared, which is nothing.
    return gaps_s, np.maximum(1, np.rint(rng.exponential(MEAN_BYTES, count))).astype(int)


def standard_error(values, batches=50):
    """Of the mean of a correlated series, by batch means: batches are long against the memory of the queue."""
    means = values[: len(values) // batches * batches].reshape(batches, -1).mean(axis=1)
    return means.std(ddof=1) / math.sqrt(batches)


# Packets for 2 % to be three standard errors: (3 / 0.02)^2 = 22,500 times the relative variance of the mean, which for
# M/M/1 is (2 + 5r - 4r^2 + r^3) / (r (1 - r)^2) [Daley], 23.8 at load r = 0.4: 535,000. M/D/1 has about half of that.
@pytest.mark.parametrize(
    ("sizes", "square_ratio", "load", "count"), [("exponential", 2.0, 0.4, 560_000), ("one", 1.0, 0.5, 350_000)]
)
def test_mean_wait_is_pollaczek_and_khinchine_s(sizes, square_ratio, load, count):
    gaps_s, sizes_bytes = drawn(load, count, 20261122, sizes)
    waits = waits_s(gaps_s.tolist(), sizes_bytes.tolist(), DirectionSettings(RATE_BPS, 20.0))
    # Mean wait = load * E[S^2] / (2 (1 - load) E[S]); E[S^2] / E[S]^2 is 2 for M/M/1 and 1 for M/D/1.
    mean_s = load * square_ratio * SERVICE_S / (2.0 * (1.0 - load))
    assert 3.0 * standard_error(waits) <= 0.02 * mean_s
    assert waits.mean() == pytest.approx(mean_s, rel=0.02)
    # Arrivals of a Poisson process see the link busy for a share of time that is the load.
    assert np.mean(waits > TOLERANCE_S) == pytest.approx(load, rel=0.02)


@settings(max_examples=50, deadline=None)
@given(st.floats(0.05, 3.0), st.integers(0, 2**32 - 1))
def test_every_wait_is_lindley_s(load, seed):
    gaps_s, sizes_bytes = drawn(load, 200, seed, "exponential")
    found = waits_s(gaps_s.tolist(), sizes_bytes.tolist(), DirectionSettings(RATE_BPS, 20.0))
    expected = [0.0]
    for service_s, gap_s in zip(8 * sizes_bytes[:-1] / RATE_BPS, gaps_s[1:], strict=True):
        expected.append(max(0.0, expected[-1] + service_s - gap_s))
    assert found == pytest.approx(expected, rel=0, abs=TOLERANCE_S)


def test_mean_waits_under_strict_priority_are_cobham_s():
    """Two Poisson streams of packets of one size, the urgent one with 0.2 of the load, the other with 0.4."""
    urgent_load, load, count = 0.2, 0.6, 120_000
    gaps_s, sizes_bytes = drawn(load, count, 20261123, "one")
    priorities = (np.random.default_rng(20261124).random(count) < urgent_load / load).astype(int).tolist()
    link_settings = DirectionSettings(RATE_BPS, 0.0, discipline="priority")
    told = figures(gaps_s.tolist(), sizes_bytes.tolist(), link_settings, lambda p: (p.priority, p.queue_s), priorities)
    # What is under way when a packet comes takes load * E[S^2] / (2 E[S]) more; all wait for that, none is cut off.
    rest_s = load * SERVICE_S / 2.0
    for priority, mean_s in ((1, rest_s / (1 - urgent_load)), (0, rest_s / ((1 - urgent_load) * (1 - load)))):
        waits = told[told[:, 0] == priority, 1]
        # Three standard errors fit into the tolerance here too.
        assert 3.0 * standard_error(waits) <= 0.05 * mean_s
        assert waits.mean() == pytest.approx(mean_s, rel=0.05)


def test_a_bounded_queue_turns_away_erlang_s_share():
    """M/M/1 with room for 3 besides the one under way: P(full) = (1 - r) r^4 / (1 - r^5)."""
    load, room, count = 0.8, 3, 100_000
    gaps_s, sizes_bytes = drawn(load, count, 20261125, "exponential")
    link_settings = DirectionSettings(RATE_BPS, 0.0, queue_limit=room)
    lost = figures(gaps_s.tolist(), sizes_bytes.tolist(), link_settings, lambda p: p.reason == "queue_full").astype(
        float
    )
    share = (1 - load) * load ** (room + 1) / (1 - load ** (room + 2))
    assert 3.0 * standard_error(lost) <= 0.05 * share
    assert lost.mean() == pytest.approx(share, rel=0.05)
