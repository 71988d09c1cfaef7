"""Use of the link from the log against what the link itself counted, and sums that must agree."""

import itertools
import math

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.reports.intervals import length_s
from teleop_sim.reports.link_use import busy, edges_of, goodput_bps, of_direction, queue, thinned, window_s, windows

END_S = 60.0
SENT = st.lists(st.tuples(st.floats(0.0, 50.0), st.integers(1, 60), st.integers(0, 2)), min_size=1, max_size=25)
KINDS = st.fixed_dictionaries(
    {
        "blackouts": st.sampled_from([(), ((5.0, 9.0), (20.0, 41.5)), ((0.0, 3.0),)]),
        "on_dark": st.sampled_from(["pause", "restart", "lose"]),
        "discipline": st.sampled_from(["fifo", "priority", "newest"]),
        "mtu_bytes": st.sampled_from([0, 20]),
        "queue_limit": st.sampled_from([0, 2]),
        "loss": st.sampled_from([Bernoulli(0.0), Bernoulli(0.3)]),
        "rates": st.sampled_from([(), ((0.0, 200.0), (15.0, 50.0), (30.0, 400.0))]),
    }
)


def carried(sent, kinds):
    """Records of a direction that carried these packets, and the direction."""
    env, records = simpy.Environment(), []
    settings = DirectionSettings(120.0, 2.0, 10, kinds.pop("blackouts"), **kinds)
    direction = Direction(env, "up", settings, lambda _: None, records.append, np.random.default_rng(1))

    def sender():
        for at_s, size, priority in sorted(sent):
            yield env.timeout(max(0.0, at_s - env.now))
            direction.send("chat", bytes(size), priority=priority)

    env.process(sender())
    env.run(END_S)
    direction.close()
    return records, direction


@settings(deadline=None)
@given(SENT, KINDS)
def test_bits_went_out_for_as_long_as_the_link_says(sent, kinds):
    records, direction = carried(sent, dict(kinds))
    out_s = sum(p.serialisation_s + p.retransmission_s for p in of_direction(records, "up"))
    assert length_s(busy(records, "up")) == pytest.approx(out_s, abs=1e-6)
    assert length_s(busy(records, "up")) == pytest.approx(END_S * direction.utilisation(), abs=1e-6)
    assert busy(records, "down") == []


@settings(deadline=None)
@given(SENT, KINDS)
def test_windows_hold_all_of_it_and_no_more_than_there_is_time(sent, kinds):
    records, direction = carried(sent, dict(kinds))
    used = windows(records, "up", END_S)
    lengths = [w.end_s - w.start_s for w in used]
    assert sum(lengths) == pytest.approx(END_S)
    assert sum(w.busy * length for w, length in zip(used, lengths, strict=True)) == pytest.approx(
        END_S * direction.utilisation(), abs=1e-6
    )
    whole = [p for p in of_direction(records, "up") if p.outcome == "delivered"]
    payload_s = sum(p.serialisation_s * 8 * p.payload_bytes / p.size_bits for p in whole)
    assert sum(w.payload * length for w, length in zip(used, lengths, strict=True)) == pytest.approx(
        payload_s, abs=1e-6
    )
    if not (kinds["mtu_bytes"] or kinds["on_dark"] == "restart"):
        # One packet at a time: no window holds more than itself.
        assert max(w.busy for w in used) <= 1.0 + 1e-6


@settings(deadline=None)
@given(SENT, KINDS)
def test_goodput_is_the_payload_that_arrived(sent, kinds):
    records, direction = carried(sent, dict(kinds))
    payload_bits = direction.delivered_bits - 8 * 10 * sum(fragments(p, kinds) for p in of_direction(records, "up"))
    bits = [
        bps * (b - a)
        for bps, (a, b) in zip(goodput_bps(records, "up", END_S), itertools.pairwise(edges_of(END_S)), strict=True)
    ]
    assert sum(bits) == pytest.approx(payload_bits)


def fragments(packet, kinds):
    """Of a packet that arrived: a header of 10 bytes each, 10 bytes of payload in the small ones."""
    whole = packet.outcome == "delivered"
    return whole * (math.ceil(packet.payload_bytes / 10) if kinds["mtu_bytes"] else 1)


@settings(deadline=None)
@given(SENT, KINDS)
def test_the_queue_over_time_is_the_waits_before_the_first_bit(sent, kinds):
    records, _ = carried(sent, dict(kinds))
    times, counts = queue(records, "up")
    assert min(counts) >= 0
    assert counts[-1] == 0
    waits_s = sum((p.t_s if np.isnan(p.service_s) else p.service_s) - p.sent_s for p in of_direction(records, "up"))
    held_s = sum((b - a) * n for (a, b), n in zip(itertools.pairwise(times), counts, strict=False))
    assert held_s == pytest.approx(waits_s, abs=1e-6)
    assert max(queue(records, "up", in_bits=True)[1]) >= max(counts)


def test_few_enough_windows():
    assert window_s(300.0) == 10.0
    assert window_s(2000.0) == 10.0
    assert window_s(2001.0) == 20.0
    assert window_s(1e9) == 3600.0
    assert windows([], "up", 25.0)[-1].end_s == 25.0
    assert len(windows([], "up", 30.0)) == 3


@given(st.lists(st.tuples(st.floats(0.001, 50.0), st.integers(0, 9)), min_size=1, max_size=300), st.integers(2, 40))
def test_thinned_steps_keep_every_height_within_a_span(steps, most):
    times, counts, at_s = [], [], 0.0
    for took_s, count in steps:
        times.append(at_s)
        counts.append(count)
        at_s += took_s
    thin_times, thin = thinned((tuple(times), tuple(counts)), at_s, most)
    assert len(thin_times) == len(thin) <= max(most + 1, len(times))
    width_s = at_s / most if len(times) > most else 0.0
    for start_s, count in zip(times, counts, strict=True):
        near = [
            n
            for t_s, n in zip(thin_times, thin, strict=True)
            if t_s <= start_s + 1e-9 and t_s + width_s >= start_s - 1e-9
        ]
        # A height is never lost: a queue that was long for a moment shows.
        assert max(near) >= count
