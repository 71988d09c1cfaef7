"""Laws of deliveries over random losses, blackouts and traffic: once, in order, nothing invented, all accounted for."""

from __future__ import annotations

import math
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.delivery import (
    DELIVERIES,
    BestEffort,
    Custody,
    SelectiveRepeat,
    StopAndWait,
    Tcp,
)
from teleop_sim.channel.jitter import NoJitter, UniformJitter
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.loss import Bernoulli, GilbertElliott, NoLoss
from teleop_sim.channel.message_ends import message_ended
from teleop_sim.core.records import PacketEnded

# Times stay below 1e5 s, where a double resolves 2e-11 s; a time is a sum of some tens of such numbers.
TOLERANCE_S = 1e-9


@st.composite
def blackout_schedules(draw):
    t, windows = 0.0, []
    for gap, length in draw(st.lists(st.tuples(st.floats(0.1, 80.0), st.floats(0.01, 80.0)), max_size=5)):
        windows.append((t + gap, t + gap + length))
        t += gap + length
    return tuple(windows)


losses = st.one_of(
    st.just(NoLoss()),
    st.builds(Bernoulli, st.floats(0.0, 0.7)),
    st.builds(GilbertElliott, st.floats(0.01, 0.5), st.floats(0.1, 1.0)),
)
jitters = st.one_of(st.just(NoJitter()), st.builds(UniformJitter, st.just(0.0), st.floats(0.1, 5.0)))


@st.composite
def ways(draw):
    return DirectionSettings(
        rate_bps=draw(st.one_of(st.floats(50.0, 1e5), st.just(math.inf))),
        delay_s=draw(st.sampled_from((0.0, 0.25, 1.3, 10.0))),
        delays=draw(st.sampled_from(((), (), ((0.0, 1.3), (30.0, 10.0), (90.0, 0.25))))),
        header_bytes=draw(st.sampled_from((0, 28))),
        blackouts=draw(blackout_schedules()),
        jitter=draw(jitters),
        reorder=draw(st.booleans()),
        loss=draw(losses),
        on_dark=draw(st.sampled_from(("pause", "restart", "lose"))),
        on_dark_flight=draw(st.sampled_from(("arrive", "lose"))),
        queue_limit=draw(st.sampled_from((0, 0, 3))),
        mtu_bytes=draw(st.sampled_from((0, 100))),
        discipline=draw(st.sampled_from(("fifo", "priority", "newest"))),
    )


timeouts = st.one_of(st.none(), st.floats(0.5, 40.0))
tries = st.one_of(st.integers(1, 4), st.just(math.inf))
repeating = st.one_of(
    st.builds(StopAndWait, timeouts, tries),
    st.builds(SelectiveRepeat, st.integers(1, 8), timeouts, tries),
    st.builds(Custody, st.sampled_from((1, 4, 32768)), timeouts, tries),
)
ends_s = st.one_of(st.floats(1.0, 300.0), st.just(math.inf))


def tcps(give_up_s):
    return st.builds(Tcp, st.integers(1, 8), give_up_s, st.booleans(), st.sampled_from((60, 1500)))


every = st.one_of(st.just(BestEffort()), repeating, tcps(ends_s))
limited = st.one_of(
    st.just(BestEffort()),
    st.builds(StopAndWait, timeouts, st.integers(1, 4)),
    st.builds(SelectiveRepeat, st.integers(1, 8), timeouts, st.integers(1, 4)),
    st.builds(Custody, st.sampled_from((1, 4)), timeouts, st.integers(1, 4)),
    tcps(st.floats(1.0, 300.0)),
)
traffics = st.lists(
    st.tuples(st.one_of(st.just(0.0), st.floats(0.0, 30.0)), st.sampled_from(("up", "down")), st.integers(0, 90)),
    min_size=4,
    max_size=25,
)


lonely_traffics = st.lists(st.tuples(st.floats(0.0, 30.0), st.just("up"), st.integers(0, 90)), min_size=1, max_size=8)


def least_bytes(by, payload_bytes, way, back):
    """Of the packet in which a message arrives: all of it, or its shortest segment."""
    if not isinstance(by, Tcp):
        return payload_bytes
    most = by.segment_bytes(way, back)
    return 40 + min(most, payload_bytes % most or most)


def least_delay_s(way):
    return min((delay_s for _, delay_s in way.delays), default=way.delay_s)


def timed(pattern):
    t, sends = 0.0, []
    for gap, name, size in pattern:
        t += gap
        sends.append((t, name, size))
    return sends


@settings(max_examples=600, deadline=None)
@given(ways(), ways(), every, every, traffics, st.floats(1.0, 900.0), st.integers(0, 2**32))
def test_every_message_has_one_fate_and_the_application_agrees(talk, up, down, up_by, down_by, pattern, until_s, seed):
    run = talk.converse((up, down), (up_by, down_by), timed(pattern), until_s, seed)
    stations = (run.station, run.site, run.link.station, up, down), (run.site, run.station, run.link.site, down, up)
    for mine, far, end, way, back in stations:
        by, got = end.delivery, far.payloads

        # Conservation: one fate a message, and the counters say the same.
        assert sorted(f.number for f in mine.fates) == list(range(len(mine.sent)))
        ends = Counter(f.outcome for f in mine.fates)
        assert set(ends) <= {"delivered", "gave_up", "in_flight"}
        assert (end.book.offered, end.book.delivered, end.book.gave_up) == (
            len(mine.sent),
            ends["delivered"],
            ends["gave_up"],
        )

        # Nothing invented, nothing twice: the other application has the delivered ones, in the order of their fates.
        assert got == [mine.sent[f.number] for f in mine.fates if f.outcome == "delivered"]
        if by.in_order:
            assert got == sorted(got, key=mine.sent.index)

        # The waits explain the whole time, and none is negative.
        for f in mine.fates:
            waits = (f.store_s, f.retransmission_s, f.link_s, f.order_s)
            assert sum(waits) == pytest.approx(f.ended_s - f.offered_s, abs=TOLERANCE_S)
            assert min(waits) >= 0.0
            assert f.tries <= by.tries or by.acknowledged
            if f.outcome == "delivered":
                least_s = 8 * (least_bytes(by, f.payload_bytes, way, back) + way.header_bytes) / way.rate_bps
                least_s += least_delay_s(way)
                assert f.link_s >= least_s - TOLERANCE_S

        # So do those of the log's record, told apart as a packet's are; only who waited for bits has any of them.
        for f in mine.fates:
            told = message_ended(f, until_s, "up" if mine is run.station else "down", way.blackouts)
            split = (told.queue_s, told.blackout_s, told.serialisation_s, told.propagation_s, told.retransmission_s)
            assert math.fsum(split) == pytest.approx(f.ended_s - f.offered_s, abs=TOLERANCE_S)
            assert min(split) >= -TOLERANCE_S
            assert (told.outcome == "delivered") == (told.delivered_s == f.ended_s)
            assert (told.outcome == "dropped") == bool(told.reason)
            if told.outcome == "delivered":
                assert told.propagation_s >= least_delay_s(way) - TOLERANCE_S
                assert (
                    told.serialisation_s >= 8 * least_bytes(by, f.payload_bytes, way, back) / way.rate_bps - TOLERANCE_S
                )

        # What the sender is told: of each message at most once, and never that what was given up has arrived.
        assert len({n for _, n, _ in mine.news}) == len(mine.news)
        lost = {f.number for f in mine.fates if f.outcome == "gave_up"}
        assert not lost & {n for _, n, ok in mine.news if ok}
        if by.acknowledged:
            assert lost <= {n for _, n, ok in mine.news if not ok}
        if by.window == 1 or not by.in_order or isinstance(by, Tcp):
            # Nobody holds anything back that is acknowledged: an acknowledged message is with the application.
            assert {n for _, n, ok in mine.news if ok} <= {f.number for f in mine.fates if f.outcome == "delivered"}


@settings(max_examples=150, deadline=None)
@given(ways(), ways(), repeating, traffics, st.integers(0, 2**32))
def test_the_same_conversation_gives_the_same_records(talk, up, down, by, pattern, seed):
    first, again = (talk.converse((up, down), (by, by), timed(pattern), 300.0, seed) for _ in range(2))
    assert repr(first.records) == repr(again.records)  # repr, because NaN is unlike itself
    assert (first.station, first.site) == (again.station, again.site)


@settings(max_examples=150, deadline=None)
@given(
    ways(),
    ways(),
    st.one_of(
        st.builds(StopAndWait, timeouts, st.just(math.inf)),
        st.builds(SelectiveRepeat, st.integers(1, 8), timeouts, st.just(math.inf)),
        st.builds(Custody, st.sampled_from((1, 4, 32768)), timeouts),
    ),
    lonely_traffics,
    st.integers(0, 2**32),
)
def test_who_never_gives_up_gets_everything_across_in_the_end(talk, up, down, by, pattern, seed):
    # The last blackout ends by 800 s; with 70 % of the packets lost each way, a try takes at most 40 s and succeeds
    # with at least (1 - 0.7)^4 (a burst model loses at most as much): 1e5 s leave less than 1e-8 of a chance to fail.
    run = talk.converse((up, down), (by, BestEffort()), timed(pattern), 1e5, seed)
    assert [f.outcome for f in run.fates] == ["delivered"] * len(pattern)
    assert sorted(run.site.payloads) == sorted(run.station.sent)


@settings(max_examples=100, deadline=None)
@given(ways(), ways(), tcps(st.just(math.inf)), lonely_traffics, st.integers(0, 2**32))
def test_tcp_that_never_gives_up_gets_everything_across_in_order(talk, up, down, by, pattern, seed):
    # 8 messages have at most 24 segments. A try takes at most 60 s (RFC 6298) and succeeds with at least 1/36 (bursts
    # lose at most 5/6 each way): of the 16,000 tries in 1e6 s some 460 do.
    run = talk.converse((up, down), (by, BestEffort()), timed(pattern), 1e6, seed)
    assert [f.outcome for f in run.fates] == ["delivered"] * len(pattern)
    assert run.site.payloads == run.station.sent
    assert [n for _, n, ok in run.news if ok] == list(range(len(pattern)))


@settings(max_examples=100, deadline=None)
@given(ways(), ways(), limited, limited, traffics, st.integers(0, 2**32))
def test_who_gives_up_some_time_lets_the_clock_end(talk, up, down, up_by, down_by, pattern, seed):
    run = talk.converse((up, down), (up_by, down_by), timed(pattern), None, seed)
    for site, by in ((run.station, up_by), (run.site, down_by)):
        if by.acknowledged and not isinstance(by, SelectiveRepeat | Custody):
            # And knows of every message whether the other site has it. Where a window is full of skips that nobody
            # acknowledged, those behind it are kept.
            assert sorted(n for _, n, _ in site.news) == list(range(len(site.sent)))


@settings(max_examples=100, deadline=None)
@given(ways(), ways(), every, every, traffics, st.integers(0, 2**32))
def test_only_best_effort_is_ever_superseded(talk, up, down, up_by, down_by, pattern, seed):
    run = talk.converse((up, down), (up_by, down_by), timed(pattern), 300.0, seed)
    for p in run.packets:
        by = up_by if p.direction == "up" else down_by
        assert p.reason != "superseded" or (p.topic == "chat" and by == BestEffort())


@settings(max_examples=100, deadline=None)
@given(ways(), ways(), st.builds(Custody, st.sampled_from((1, 4))), traffics, st.integers(0, 2**32))
def test_custody_offers_no_message_to_a_link_that_it_knows_to_be_dark(talk, up, down, by, pattern, seed):
    run = talk.converse((up, down), (by, by), timed(pattern), 600.0, seed)
    ways_by_name = {"up": up, "down": down}
    for p in run.records:
        if isinstance(p, PacketEnded) and p.topic == "chat":
            assert not any(dark <= p.sent_s < light for dark, light in ways_by_name[p.direction].blackouts)


@pytest.mark.parametrize("name", sorted(DELIVERIES))
def test_every_delivery_is_frozen_data_with_the_shared_fields(name):
    made = DELIVERIES[name]()
    assert made == DELIVERIES[name]()
    assert hash(made) == hash(DELIVERIES[name]())
    assert made.window >= 1
    assert made.tries >= 1
