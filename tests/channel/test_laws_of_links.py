"""What holds for every link and every traffic: conservation, order, no time travel, waits that add up, no growth."""

from __future__ import annotations

import math
import tracemalloc
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np
import pytest
import simpy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from teleop_sim.channel.blackouts import first_light
from teleop_sim.channel.counters import WAITS
from teleop_sim.channel.jitter import EmpiricalJitter, NoJitter, NormalJitter, UniformJitter
from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.loss import Bernoulli, GilbertElliott, NoLoss
from teleop_sim.channel.queueing import DISCIPLINES, DROPS
from teleop_sim.channel.radio import Radio
from teleop_sim.channel.radio_base import Carrier
from teleop_sim.channel.radio_planned import PlannedRadio
from teleop_sim.channel.rates import bits_between, finish_of, rate_at
from teleop_sim.core.records import PacketEnded

# Times stay below 1e4 s, where a double resolves 2e-12 s; a packet's times are sums of some tens of such numbers.
TOLERANCE_S = 1e-9
FOREVER_S = 1e5
"""Longer than 25 packets of 76 fragments take at 64 bit/s, with all blackouts."""


@dataclass(frozen=True)
class Offer:
    """Something to send: so long after the one before, so many bytes, on a topic, how urgent."""

    gap_s: float
    size: int
    topic: str = "chat"
    priority: int = 0


@dataclass
class Run:
    """A direction after its run, what was offered, what its receiver got and when, and its packet records."""

    link: Direction | Carrier
    until_s: float
    offered: list[bytes] = field(default_factory=list)
    arrived: list[tuple[float, bytes]] = field(default_factory=list)
    packets: list[PacketEnded] = field(default_factory=list)

    @property
    def delivered(self) -> list[PacketEnded]:
        return [p for p in self.packets if p.outcome == "delivered"]

    @property
    def by_number(self) -> list[PacketEnded]:
        return sorted(self.packets, key=lambda p: p.packet)


def closed_form(env, name, link_settings, receive, emit, _):
    return PlannedRadio(env, name, link_settings, receive, emit)


def run(link_settings, traffic, until_s, seed=0, kind=Direction):
    """Offer the traffic to one direction; close it at ``until_s``. Every payload is another one."""
    env = simpy.Environment()

    def keep(record):
        if isinstance(record, PacketEnded):
            done.packets.append(record)

    def receive(data):
        done.arrived.append((env.now, data))

    link = kind(env, "up", link_settings, receive, keep, np.random.default_rng(seed))
    done = Run(link, until_s)

    def sender():
        for i, offer in enumerate(traffic):
            yield env.timeout(offer.gap_s)
            done.offered.append(i.to_bytes(2, "big") + b"." * offer.size)
            link.send(offer.topic, done.offered[-1], "", offer.priority)

    env.process(sender())
    env.run(until=until_s)
    link.close()
    return done


def assert_conserved(done):
    """sent = delivered + dropped + in flight, packet by packet; the receiver got those delivered and nothing else."""
    counts, ends = done.link.counters, Counter(p.outcome for p in done.packets)
    assert set(ends) <= {"delivered", "dropped", "in_flight"}
    assert done.link.sent == len(done.offered) == len(done.packets) == len({p.packet for p in done.packets})
    assert done.link.sent == sum(ends.values()) == counts.total.offered
    assert (counts.total.delivered, counts.total.in_flight) == (ends["delivered"], ends["in_flight"])
    assert counts.total.dropped == Counter(p.reason for p in done.packets if p.outcome == "dropped")
    for topic, count in counts.by_topic.items():
        assert count.offered == sum(p.topic == topic for p in done.packets)
    assert all(bool(p.reason) == (p.outcome == "dropped") for p in done.packets)
    assert [data for _, data in done.arrived] == [done.offered[p.packet] for p in done.delivered]
    assert [t_s for t_s, _ in done.arrived] == [p.arrived_s for p in done.delivered]


def assert_no_time_travel(done):
    """Nothing comes before its bits at the best rate and the least delay allow, or after the end, or from the dark."""
    link = done.link.settings
    fastest_bps = max((rate_bps for _, rate_bps in link.rates), default=link.rate_bps)
    least_delay_s = min((delay_s for _, delay_s in link.delays), default=link.delay_s)
    least_s = max(0.0, least_delay_s + link.jitter.least_s)
    for p in done.packets:
        assert p.sent_s <= p.t_s <= done.until_s
        assert p.outcome == "delivered" or math.isnan(p.arrived_s)
        assert math.isnan(p.service_s) or p.service_s >= p.sent_s
        assert not any(start_s <= p.service_s < end_s for start_s, end_s in link.blackouts)
    for p in done.delivered:
        assert p.arrived_s == p.t_s
        assert p.arrived_s - p.service_s >= p.size_bits / fastest_bps + least_s - TOLERANCE_S
    assert [p.t_s for p in done.packets] == sorted(p.t_s for p in done.packets)


def assert_waits_add_up(done):
    """The waits explain all the time from offer to end; none is negative."""
    for p in done.packets:
        waits = (p.queue_s, p.blackout_s, p.serialisation_s, p.propagation_s, p.retransmission_s)
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
topics = st.sampled_from(("chat", "image", "log"))


def lists_of(offers):
    """Up to 25 offers, any number as likely: left to itself, hypothesis makes most lists short."""
    return st.integers(0, 25).flatmap(lambda n: st.lists(offers, min_size=n, max_size=n))


traffics = lists_of(st.builds(Offer, gaps, st.integers(0, 300), topics, st.integers(0, 2)))
ends = st.floats(1.0, 600.0)
plain_links = st.builds(
    DirectionSettings,
    rate_bps=st.one_of(st.floats(8.0, 1e6), st.just(math.inf)),
    delay_s=st.one_of(st.just(0.0), st.floats(0.0, 30.0)),
    header_bytes=st.sampled_from((0, 28, 40)),
    blackouts=blackouts,
)


@settings(max_examples=600, deadline=None)
@given(plain_links, traffics, ends)
def test_a_plain_link_conserves_packets_keeps_their_order_and_never_hurries(link_settings, traffic, until_s):
    done = run(link_settings, traffic, until_s)
    assert_conserved(done)
    assert_no_time_travel(done)
    assert_waits_add_up(done)
    assert [p.packet for p in done.packets] == list(range(len(done.packets)))
    assert done.link.counters.total.dropped == {}


# Times that cannot tie: offers come at multiples of pi/8 s, blackouts begin and end at multiples of e/8 s, rates change
# at multiples of sqrt(2)/8 s, delays at multiples of sqrt(3)/8 s, and bits take rational times. Which of two events of
# one instant is first is not a law.
def untied(step_s):
    return st.integers(1, 200).map(lambda n: n * step_s / 8.0)


untied_blackouts = st.lists(st.tuples(untied(math.e), untied(math.e)), max_size=5).map(windows)
untied_gaps = st.one_of(st.just(0.0), untied(math.pi))
untied_traffics = lists_of(st.builds(Offer, untied_gaps, st.integers(0, 300), topics, st.integers(0, 2)))
whole_rates = st.sampled_from((64.0, 380.0, 4000.0, 1e5))


@st.composite
def rate_schedules(draw):
    times = sorted(draw(st.sets(untied(math.sqrt(2.0)), max_size=4)))
    return tuple((t_s, draw(whole_rates)) for t_s in (0.0, *times))


@st.composite
def delay_schedules(draw):
    times = sorted(draw(st.sets(untied(math.sqrt(3.0)), max_size=4)))
    return tuple((t_s, draw(st.floats(6.0, 30.0))) for t_s in (0.0, *times))


radio_limits = {
    "queue_limit": st.integers(0, 4),
    "discipline": st.sampled_from(tuple(DISCIPLINES)),
    "drop": st.sampled_from(DROPS),
    "mtu_bytes": st.sampled_from((0, 44, 100)),
}
budgets = st.sampled_from((math.inf, math.inf, math.inf, 4_000, 20_000, 40_001))
jitters = st.sampled_from(
    (NoJitter(), UniformJitter(-2.0, 9.0), NormalJitter(3.0, 6.0), EmpiricalJitter((0.0, 0.5, -1.0, 20.0)))
)
losses = st.sampled_from((NoLoss(), Bernoulli(0.3), GilbertElliott(0.2, 0.4, 0.9)))
any_radio = {
    **radio_limits,
    "delays": st.one_of(st.just(()), delay_schedules()),
    "header_bytes": st.sampled_from((0, 28, 40)),
    "jitter": jitters,
    "reorder": st.booleans(),
    "loss": losses,
    "on_dark": st.sampled_from(("pause", "restart", "lose")),
    "on_dark_flight": st.sampled_from(("arrive", "lose")),
    "budget_bits": budgets,
}
untied_links = st.builds(
    DirectionSettings,
    rate_bps=st.just(64.0),
    delay_s=st.floats(6.0, 30.0),
    blackouts=untied_blackouts,
    rates=st.one_of(st.just(()), rate_schedules()),
    **any_radio,
)
wild_links = st.builds(
    DirectionSettings,
    rate_bps=st.one_of(st.floats(8.0, 1e6), st.just(math.inf)),
    delay_s=st.floats(6.0, 30.0),
    blackouts=blackouts,
    rates=st.one_of(st.just(()), rate_schedules()),
    **any_radio,
)


def possible_reasons(link):
    """What may be a reason for a drop at all."""
    loses_in_the_dark = bool(link.blackouts) and "lose" in (link.on_dark, link.on_dark_flight)
    may = {
        "queue_full": link.queue_limit > 0,
        "superseded": link.discipline == "newest",
        "lost": link.loss.mean_loss > 0.0,
        "blackout": loses_in_the_dark,
        "budget": math.isfinite(link.budget_bits),
    }
    return {reason for reason, possible in may.items() if possible}


def assert_order(done):
    """Without reordering, packets of one line arrive in the order offered: all, those of a priority or of a topic."""
    link = done.link.settings
    if link.reorder:
        return
    line_of = {"fifo": lambda _: 0, "priority": lambda p: p.priority, "newest": lambda p: p.topic}[link.discipline]
    for line in {line_of(p) for p in done.delivered}:
        numbers = [p.packet for p in done.delivered if line_of(p) == line]
        assert numbers == sorted(numbers)


def assert_within_capacity(done):
    """By the time a packet is out, no more bits are out than rate and light allow; nor ever more than the budget."""
    link = done.link.settings
    rates = link.rates or ((0.0, link.rate_bps),)
    out = sorted((p.t_s - p.propagation_s, p.size_bits) for p in done.packets if p.outcome == "delivered")
    bits = 0
    for finish_s, size_bits in out:
        bits += size_bits
        allowed = bits_between(0.0, finish_s, rates, link.blackouts)
        assert bits <= allowed + TOLERANCE_S * max(1.0, rate_at(finish_s, rates))
    assert bits <= link.budget_bits


def assert_room(done):
    """Never more packets in the queue than there is room for."""
    link = done.link.settings
    if link.queue_limit:
        stays = [(p.sent_s, p.t_s if math.isnan(p.service_s) else p.service_s) for p in done.packets]
        for entered_s, _ in stays:
            assert sum(a_s <= entered_s < b_s for a_s, b_s in stays) <= link.queue_limit


@settings(max_examples=900, deadline=None)
@given(wild_links, traffics, ends, st.integers(0, 2**32 - 1))
def test_every_link_conserves_packets_keeps_their_order_and_never_hurries(link_settings, traffic, until_s, seed):
    done = run(link_settings, traffic, until_s, seed)
    assert_conserved(done)
    assert_no_time_travel(done)
    assert_waits_add_up(done)
    assert_order(done)
    assert_within_capacity(done)
    assert_room(done)
    assert {p.reason for p in done.packets} - {""} <= possible_reasons(link_settings)


@settings(max_examples=100, deadline=None)
@given(wild_links, traffics, ends, st.integers(0, 2**32 - 1))
def test_the_same_seed_gives_the_same_records(link_settings, traffic, until_s, seed):
    first, again = (run(link_settings, traffic, until_s, seed).packets for _ in range(2))
    assert repr(first) == repr(again)  # repr, because NaN is unlike itself


class Loop:
    """An independent radio: no clock and no events, one loop over fragments, lists that are searched.

    It knows the rules of docs/link.md and shares only the arithmetic of schedules and the draws, tested elsewhere.

    Attributes:
        fates: of each packet, why it was dropped (or nothing), when it ended, and how long bits went out in vain [s].

    """

    def __init__(self, link, traffic, seed):
        self.link, self.traffic = link, traffic
        self.rates = link.rates or ((0.0, link.rate_bps),)
        self.loss_rng, jitter_rng = np.random.default_rng(seed).spawn(2)
        self.jitters_s = [link.jitter.draw_s(jitter_rng) for _ in traffic]
        self.parts = [fragments_of(offer.size + 2, link) for offer in traffic]
        self.bits = [sum(parts) for parts in self.parts]
        self.sent_s = np.cumsum([offer.gap_s for offer in traffic]).tolist()
        self.coming = deque(range(len(traffic)))
        self.waiting, self.place, self.started = [], {}, set()
        self.left_bits, self.bad, self.last_s = link.budget_bits, False, 0.0
        self.fates, self.doomed, self.vain_s = {}, {}, dict.fromkeys(self.coming, 0.0)
        now_s = 0.0
        while self.coming or self.waiting:
            now_s = self.serve(now_s)

    def end(self, i, reason, t_s):
        self.fates[i] = (reason, t_s, self.vain_s[i])

    def urgency(self, i):
        return self.traffic[i].priority if self.link.discipline == "priority" else 0

    def admit_before(self, t_s):
        while self.coming and self.sent_s[self.coming[0]] < t_s:
            self.admit(self.coming.popleft())

    def admit(self, i):
        fresh = [k for k in self.waiting if k not in self.started]
        self.place[i] = i
        if self.link.discipline == "newest":
            for older in [k for k in fresh if self.traffic[k].topic == self.traffic[i].topic]:
                self.place[i] = self.place[older]
                self.end(older, "superseded", self.sent_s[i])
                fresh.remove(older)
                self.waiting.remove(older)
        self.waiting.append(i)
        fresh.append(i)
        if self.link.queue_limit and len(fresh) > self.link.queue_limit:
            least = min(map(self.urgency, fresh))
            line = sorted((k for k in fresh if self.urgency(k) == least), key=self.place.get)
            gone = line[-1 if self.link.drop == "tail" else 0]
            self.end(gone, "queue_full", self.sent_s[i])
            self.waiting.remove(gone)

    def serve(self, now_s):
        """One fragment; when it is over."""
        link = self.link
        if not self.waiting:
            now_s = max(now_s, self.sent_s[self.coming[0]])
            self.admit(self.coming.popleft())
        if (light_s := first_light(now_s, link.blackouts)) > now_s:
            now_s = light_s
            self.admit_before(now_s)
        head = min(self.waiting, key=lambda i: (-self.urgency(i), i not in self.started, self.place[i]))
        self.waiting.remove(head)
        if head not in self.started:
            if self.bits[head] > self.left_bits:
                self.end(head, "budget", now_s)
                return now_s
            self.left_bits -= self.bits[head]
            self.started.add(head)
        until_s, cut = part_ends(now_s, self.parts[head][0], link, self.rates)
        self.admit_before(until_s)
        if cut and link.on_dark == "lose":
            self.end(head, "blackout", until_s)
            return until_s
        if cut:
            self.vain_s[head] += until_s - now_s
        else:
            self.doom(head, now_s, until_s)
            self.parts[head] = self.parts[head][1:]
        if self.parts[head]:
            self.waiting.append(head)
        else:
            self.land(head, until_s + self.flight_s(head, until_s))
        return until_s

    def flight_s(self, i, out_s):
        """How long a bit that goes out then is in the air: the delay set last."""
        past = [delay_s for from_s, delay_s in self.link.delays if from_s <= out_s]
        return (past[-1] if past else self.link.delay_s) + self.jitters_s[i]

    def doom(self, i, from_s, until_s):
        """A fragment is out: does anything happen to it on its way?"""
        self.bad, lost = self.link.loss.step(self.bad, self.loss_rng)
        in_air_s = until_s + self.flight_s(i, until_s)
        if self.link.on_dark_flight == "lose" and any(from_s < t_s < in_air_s for t_s, _ in self.link.blackouts):
            self.doomed.setdefault(i, "blackout")
        if lost:
            self.doomed.setdefault(i, "lost")

    def land(self, i, t_s):
        """It arrives, unless a part was lost; without reordering not before those ahead."""
        if i in self.doomed:
            self.end(i, self.doomed[i], t_s)
            return
        self.last_s = t_s if self.link.reorder else max(t_s, self.last_s)
        self.end(i, "", self.last_s)


def fragments_of(size, link):
    """Sizes in bits: payload cut so that each piece and its header fill an MTU, the last one what is left."""
    most = link.mtu_bytes - link.header_bytes if link.mtu_bytes else size
    return [8 * (min(most, size - at) + link.header_bytes) for at in range(0, size, most)]


def part_ends(begin_s, bits, link, rates):
    """When a fragment is over, and whether the dark cut it off."""
    if link.on_dark == "pause":
        return finish_of(begin_s, bits, rates, link.blackouts), False
    whole_s = finish_of(begin_s, bits, rates, ())
    dark_s = min((start_s for start_s, _ in link.blackouts if start_s > begin_s), default=math.inf)
    return min(whole_s, dark_s), whole_s > dark_s


@settings(max_examples=600, deadline=None)
@given(untied_links, untied_traffics, st.integers(0, 2**32 - 1))
def test_the_radio_equals_a_loop_over_fragments(link_settings, traffic, seed):
    done = run(link_settings, traffic, FOREVER_S, seed)
    fates = Loop(link_settings, traffic, seed).fates
    assert {p.packet: p.reason for p in done.packets} == {i: reason for i, (reason, _, _) in fates.items()}
    for p in done.packets:
        _, end_s, vain_s = fates[p.packet]
        assert (p.t_s, p.retransmission_s) == pytest.approx((end_s, vain_s), rel=0, abs=TOLERANCE_S)
    assert_conserved(done)
    assert_waits_add_up(done)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 100), min_size=1, max_size=20), st.data())
def test_a_budget_lets_through_what_it_covers_to_the_bit(sizes, data):
    bits = [8 * (size + 2 + 28) for size in sizes]
    covered = data.draw(st.integers(1, len(sizes)))
    traffic = [Offer(1.0, size) for size in sizes]
    for budget_bits, first_drop in ((sum(bits[:covered]), covered), (sum(bits[:covered]) - 1, covered - 1)):
        if budget_bits <= 8 * 28:
            continue
        done = run(DirectionSettings(1e3, 5.0, 28, budget_bits=budget_bits), traffic, FOREVER_S)
        reasons = [p.reason for p in done.by_number]
        assert reasons[: first_drop + 1] == (["" for _ in range(first_drop)] + ["budget"])[: len(sizes)]


@settings(max_examples=300, deadline=None)
@given(plain_links, traffics, ends)
def test_the_radio_equals_the_closed_form_where_both_apply(link_settings, traffic, until_s):
    # What begins at the very instant of the end has begun in one of them and not in the other.
    assume(all(until_s not in dark for dark in link_settings.blackouts))
    closed, radio = (run(link_settings, traffic, until_s, kind=kind) for kind in (closed_form, Radio))
    assert len(closed.packets) == len(radio.packets)
    for a, b in zip(closed.by_number, radio.by_number, strict=True):
        assert (a.outcome, a.topic, a.size_bits, a.priority) == (b.outcome, b.topic, b.size_bits, b.priority)
        for name in ("service_s", "arrived_s", *WAITS):
            assert getattr(a, name) == pytest.approx(getattr(b, name), rel=0, abs=TOLERANCE_S, nan_ok=True)


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
