"""Laws of deliveries over random losses, blackouts and traffic: once, in order, nothing invented, all accounted for."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.delivery import (
    DELIVERIES,
    BestEffort,
    Connection,
    Custody,
    Endpoint,
    Fate,
    SelectiveRepeat,
    StopAndWait,
    connect,
)
from teleop_sim.channel.jitter import NoJitter, UniformJitter
from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import Bernoulli, GilbertElliott, NoLoss
from teleop_sim.core.records import PacketEnded, Record

# Times stay below 1e5 s, where a double resolves 2e-11 s; a time is a sum of some tens of such numbers.
TOLERANCE_S = 1e-9


@dataclass
class Site:
    """One site's application: what it sent, got, was told; and the fates of what it sent."""

    sent: list[bytes] = field(default_factory=list)
    got: list[bytes] = field(default_factory=list)
    news: list[tuple[int, bool]] = field(default_factory=list)
    fates: list[Fate] = field(default_factory=list)


@dataclass
class Run:
    sites: dict[str, Site]
    records: list[Record]
    link: Connection


def converse(ways, deliveries, sends, until_s, seed):
    """Play ``(t_s, name, size_bytes)`` over a connection; the first two bytes of a payload make it unlike others."""
    env = simpy.Environment()
    sites = {"up": Site(), "down": Site()}
    records: list[Record] = []
    streams = dict(zip(ways, np.random.default_rng(seed).spawn(2), strict=True))

    def make(name, receive, emit):
        return Direction(env, name, ways[name], receive, emit, streams[name])

    def endpoint(name):
        site = sites[name]
        return Endpoint(
            env, deliveries[name], site.got.append, site.fates.append, lambda n, ok: site.news.append((n, ok))
        )

    ends = {"up": endpoint("up"), "down": endpoint("down")}
    link = connect(make, ends["up"], ends["down"], records.append)

    def talk():
        for t_s, name, size in sends:
            yield env.timeout(t_s - env.now)
            payload = len(sites[name].sent).to_bytes(2, "big") + b"." * size
            sites[name].sent.append(payload)
            assert ends[name].send("chat", payload) == len(sites[name].sent) - 1

    env.process(talk())
    env.run(until=until_s)
    link.close()
    return Run(sites, records, link)


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
        header_bytes=draw(st.sampled_from((0, 28))),
        blackouts=draw(blackout_schedules()),
        jitter=draw(jitters),
        reorder=draw(st.booleans()),
        loss=draw(losses),
        on_dark=draw(st.sampled_from(("pause", "restart", "lose"))),
        on_dark_flight=draw(st.sampled_from(("arrive", "lose"))),
        queue_limit=draw(st.sampled_from((0, 0, 3))),
        mtu_bytes=draw(st.sampled_from((0, 64))),
        discipline=draw(st.sampled_from(("fifo", "priority", "newest"))),
    )


timeouts = st.one_of(st.none(), st.floats(0.5, 40.0))
tries = st.one_of(st.integers(1, 4), st.just(math.inf))
repeating = st.one_of(
    st.builds(StopAndWait, timeouts, tries),
    st.builds(SelectiveRepeat, st.integers(1, 8), timeouts, tries),
    st.builds(Custody, st.sampled_from((1, 4, 32768)), timeouts, tries),
)
every = st.one_of(st.just(BestEffort()), repeating)
traffics = st.lists(
    st.tuples(st.one_of(st.just(0.0), st.floats(0.0, 30.0)), st.sampled_from(("up", "down")), st.integers(0, 90)),
    min_size=4,
    max_size=25,
)


def timed(pattern):
    t, sends = 0.0, []
    for gap, name, size in pattern:
        t += gap
        sends.append((t, name, size))
    return sends


@settings(max_examples=600, deadline=None)
@given(ways(), ways(), every, every, traffics, st.floats(1.0, 900.0), st.integers(0, 2**32))
def test_every_message_has_one_fate_and_the_application_agrees(up, down, up_by, down_by, pattern, until_s, seed):
    deliveries = {"up": up_by, "down": down_by}
    run = converse({"up": up, "down": down}, deliveries, timed(pattern), until_s, seed)
    for name, far, end in (("up", "down", run.link.station), ("down", "up", run.link.site)):
        mine, got = run.sites[name], run.sites[far].got

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
        if deliveries[name].in_order:
            assert got == sorted(got, key=mine.sent.index)

        # The waits explain the whole time, and none is negative.
        for f in mine.fates:
            waits = (f.store_s, f.retransmission_s, f.link_s, f.order_s)
            assert sum(waits) == pytest.approx(f.ended_s - f.offered_s, abs=TOLERANCE_S)
            assert min(waits) >= 0.0
            assert f.tries <= deliveries[name].tries or deliveries[name].acknowledged
            if f.outcome == "delivered":
                way = up if name == "up" else down
                least_s = 8 * (f.payload_bytes + way.header_bytes) / way.rate_bps + way.delay_s
                assert f.link_s >= least_s - TOLERANCE_S

        # What the sender is told: of each message at most once, and never that what was given up has arrived.
        assert len({n for n, _ in mine.news}) == len(mine.news)
        lost = {f.number for f in mine.fates if f.outcome == "gave_up"}
        assert not lost & {n for n, ok in mine.news if ok}
        if deliveries[name].acknowledged:
            assert lost <= {n for n, ok in mine.news if not ok}
        if deliveries[name].window == 1 or not deliveries[name].in_order:
            # Nobody holds anything back: an acknowledged message is with the application.
            assert {n for n, ok in mine.news if ok} <= {f.number for f in mine.fates if f.outcome == "delivered"}


@settings(max_examples=150, deadline=None)
@given(ways(), ways(), repeating, traffics, st.integers(0, 2**32))
def test_the_same_conversation_gives_the_same_records(up, down, by, pattern, seed):
    first, again = (
        converse({"up": up, "down": down}, {"up": by, "down": by}, timed(pattern), 300.0, seed) for _ in range(2)
    )
    assert repr(first.records) == repr(again.records)  # repr, because NaN is unlike itself
    assert first.sites == again.sites


@settings(max_examples=150, deadline=None)
@given(
    ways(),
    ways(),
    st.one_of(
        st.builds(StopAndWait, timeouts, st.just(math.inf)),
        st.builds(SelectiveRepeat, st.integers(1, 8), timeouts, st.just(math.inf)),
        st.builds(Custody, st.sampled_from((1, 4, 32768)), timeouts),
    ),
    st.lists(st.tuples(st.floats(0.0, 30.0), st.just("up"), st.integers(0, 90)), min_size=1, max_size=8),
    st.integers(0, 2**32),
)
def test_who_never_gives_up_gets_everything_across_in_the_end(up, down, by, pattern, seed):
    # The last blackout ends by 800 s; with 70 % of the packets lost each way, a try takes at most 40 s and succeeds
    # with at least (1 - 0.7)^4 (a burst model loses at most as much): 1e5 s leave less than 1e-8 of a chance to fail.
    run = converse({"up": up, "down": down}, {"up": by, "down": BestEffort()}, timed(pattern), 1e5, seed)
    mine = run.sites["up"]
    assert [f.outcome for f in mine.fates] == ["delivered"] * len(pattern)
    assert sorted(run.sites["down"].got) == sorted(mine.sent)


@settings(max_examples=100, deadline=None)
@given(ways(), ways(), st.builds(Custody, st.sampled_from((1, 4))), traffics, st.integers(0, 2**32))
def test_custody_offers_no_message_to_a_link_that_it_knows_to_be_dark(up, down, by, pattern, seed):
    run = converse({"up": up, "down": down}, {"up": by, "down": by}, timed(pattern), 600.0, seed)
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
