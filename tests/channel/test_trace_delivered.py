"""Messages through a delivery over both ways: a row a message, in closed form and by laws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.arq import timeout_for
from teleop_sim.channel.delivery import DELIVERIES, BestEffort, Custody, SelectiveRepeat, StopAndWait, Tcp
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.trace import Offer, trace
from teleop_sim.channel.trace_delivered import trace_delivered
from teleop_sim.core.errors import BadInput

WAITS = ("queue_s", "serialisation_s", "blackout_s", "propagation_s", "retransmission_s")
UP, DOWN = DirectionSettings(64.0, 10.0), DirectionSettings(50_000.0, 10.0)


def traced(offers, by, up=UP, down=DOWN, seed=0, until_s=1e5, **more):
    ways = tuple(zip((up, down), np.random.default_rng(seed).spawn(2), strict=True))
    return trace_delivered(offers, by, ways, until_s=until_s, **more)


def waits(row):
    return tuple(getattr(row, name) for name in WAITS)


def test_a_message_and_its_successor_by_stop_and_wait():
    first, second = traced([Offer(0.0, "a", 18), Offer(0.0, "b", 18)], StopAndWait())
    # Frames of 21 bytes: 2.625 s; an acknowledgement of 3 bytes at 50 kbit/s: 0.48 ms.
    cycle_s = 2.625 + 10.0 + 0.00048 + 10.0
    assert first.arrived_s == pytest.approx(12.625, abs=1e-9)
    assert second.arrived_s == pytest.approx(cycle_s + 12.625, abs=1e-9)
    assert waits(second) == pytest.approx((cycle_s, 2.625, 0.0, 10.0, 0.0), abs=1e-9)


def test_what_is_repeated_is_told_as_retransmission(talk):
    (row,) = traced([Offer(3.0, "a", 18)], SelectiveRepeat(), replace(UP, loss=talk.These(0, 1)))
    again_s = 2 * timeout_for(UP, DOWN, 18)
    assert row.arrived_s == pytest.approx(3.0 + again_s + 12.625, abs=1e-9)
    assert waits(row) == pytest.approx((0.0, 2.625, 0.0, 10.0, again_s), abs=1e-9)


def test_what_custody_keeps_in_the_dark_is_told_as_dark():
    (row,) = traced([Offer(7.0, "a", 1)], Custody(), replace(UP, blackouts=((5.0, 1000.0),)))
    assert waits(row) == pytest.approx((0.0, 0.5, 993.0, 10.0, 0.0), abs=1e-9)


def test_the_handshake_of_tcp_is_waiting_and_its_headers_are_bits():
    up = down = DirectionSettings(10_000.0, 0.25)
    (row,) = traced([Offer(0.0, "a", 18)], Tcp(), up, down)
    # SYN, SYN+ACK and ACK have 320 bits each, the data 464.
    assert waits(row) == pytest.approx((0.032 + 0.25 + 0.032 + 0.25 + 0.032, 0.0464, 0.0, 0.25, 0.0), abs=1e-9)


def test_what_was_given_up_is_dropped_and_all_its_sending_was_in_vain(talk):
    rows = traced([Offer(0.0, "a", 1)], StopAndWait(30.0, 2), replace(UP, loss=talk.These(*range(9))))
    assert [(row.outcome, row.reason, row.arrived_s) for row in rows] == [("dropped", "gave_up", None)]
    assert waits(rows[0]) == (0.0, 0.0, 0.0, 0.0, 60.0)


def test_tcp_over_mars_says_that_it_never_had_a_connection():
    mars = DirectionSettings(2e6, 750.0)
    (row,) = traced([Offer(0.0, "a", 18)], Tcp(), mars, mars)
    assert (row.outcome, row.reason, row.arrived_s) == ("dropped", "no_connection", None)
    assert waits(row) == (924.6, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("way", "least_bytes"), [("up", 41), ("down", 40)])
def test_light_too_short_for_a_packet_of_tcp_is_refused_to_the_bit(way, least_bytes):
    """A segment with a byte has to go up, an acknowledgement without data down."""

    def ways(light_s):
        dark = DirectionSettings(64.0, 1.0, blackouts=((light_s, math.inf),), on_dark="restart")
        return {way: dark, "until_s": 1.0}

    light_s = 8 * least_bytes / 64.0
    traced([Offer(0.0, "a", 1)], Tcp(), **ways(light_s))
    with pytest.raises(BadInput, match=f"{way}.blackouts: .* one fragment has {8 * least_bytes} and the rule"):
        traced([Offer(0.0, "a", 1)], Tcp(), **ways(light_s - 0.01))
    # Frames of a few bytes still fit.
    traced([Offer(0.0, "a", 1)], StopAndWait(), **ways(light_s - 0.01))


def test_a_budget_below_one_packet_of_tcp_is_refused():
    with pytest.raises(BadInput, match=r"up.budget_bits: a budget of 327 bits is below one packet of TCP \(328 bits\)"):
        traced([Offer(0.0, "a", 1)], Tcp(), replace(UP, budget_bits=327))


def test_the_other_way_round_the_messages_go_down():
    assert traced([Offer(0.0, "a", 18)], Tcp(), way="down") == traced([Offer(0.0, "a", 18)], Tcp())


@pytest.mark.parametrize("dead", ["up", "down"])
def test_a_way_back_that_delivers_nothing_is_refused_too(dead):
    dark = {dead: replace(UP, blackouts=((0.0, math.inf),))}
    with pytest.raises(BadInput, match=f"{dead}.blackouts: it is dark all the time"):
        traced([Offer(0.0, "a", 1)], StopAndWait(), **dark)


offers = st.lists(
    st.builds(Offer, st.floats(0, 50), st.sampled_from("ab"), st.integers(1, 60), st.integers(0, 2)), max_size=10
)
schedules = st.sampled_from(((), ((5.0, 9.0), (20.0, 30.0)), ((0.0, 2.0), (40.0, 300.0))))
ways = st.builds(
    DirectionSettings,
    rate_bps=st.floats(50.0, 1e5),
    delay_s=st.sampled_from((0.0, 1.0, 10.0)),
    blackouts=schedules,
    loss=st.builds(Bernoulli, st.sampled_from((0.0, 0.3))),
    on_dark=st.sampled_from(("pause", "restart", "lose")),
    discipline=st.sampled_from(("fifo", "priority")),
    mtu_bytes=st.sampled_from((0, 60)),
)
deliveries = st.sampled_from(sorted(DELIVERIES)).map(lambda name: DELIVERIES[name]())


@settings(max_examples=150, deadline=None)
@given(offers, deliveries, ways, ways, st.integers(0, 99), st.sampled_from((60.0, 2000.0)))
def test_every_message_has_a_row_and_its_waits_add_up(sent, by, up, down, seed, until_s):
    rows = traced(sent, by, up, down, seed, until_s)
    assert [row.id for row in rows] == list(range(len(sent)))
    assert [row.sent_s for row in rows] == sorted(offer.time_s for offer in sent)
    for row in rows:
        assert (row.outcome == "delivered") == (row.arrived_s is not None)
        assert (row.outcome == "dropped") == bool(row.reason)
        assert min(waits(row)) >= 0.0
        if row.arrived_s is not None:
            # Sums of times below 1e4 s in double precision.
            assert sum(waits(row)) == pytest.approx(row.arrived_s - row.sent_s, abs=1e-8)


@settings(max_examples=50, deadline=None)
@given(offers, ways, st.integers(0, 99))
def test_best_effort_gives_the_rows_of_the_bare_link(sent, up, seed):
    out_rng, _ = np.random.default_rng(seed).spawn(2)
    bare = trace(sent, up, out_rng)
    for row, other in zip(traced(sent, BestEffort(), up, UP, seed), bare, strict=True):
        assert (row.id, row.arrived_s, row.reason) == (other.id, other.arrived_s, other.reason)
        if row.arrived_s is not None:
            assert waits(row) == waits(other)
