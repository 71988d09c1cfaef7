"""The radio in closed form: changes of rate, priorities, drops, budgets, blackouts, order."""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass

import numpy as np
import pytest
import simpy

from teleop_sim.channel.jitter import EmpiricalJitter, UniformJitter
from teleop_sim.channel.link import Direction, DirectionSettings, LinkClosed
from teleop_sim.channel.loss import Bernoulli, GilbertElliott
from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import Blackout, PacketEnded

# Times stay below 1e4 s, where a double resolves 2e-12 s; a packet's times are sums of some tens of such numbers.
TOLERANCE_S = 1e-9


@dataclass(frozen=True)
class Draws:
    """Jitter in a given order, to follow by hand."""

    left_s: list[float]
    least_s: float = 0.0
    mean_s: float = 0.0

    def draw_s(self, _):
        return self.left_s.pop(0)


@dataclass(frozen=True)
class Losses:
    """Loss in a given order, to follow by hand."""

    left: list[bool]
    mean_loss: float = 0.5

    def step(self, bad, _):
        return bad, self.left.pop(0)


class Run:
    """Sends ``(t_s, bytes, priority, topic)`` over one direction to the end; numbers are the order in which sent."""

    def __init__(self, settings, sends, until_s=1000.0, seed=1, switch=()):
        env = simpy.Environment()
        self.arrived, self.records = [], []
        rng = np.random.default_rng(seed)
        link = self.link = Direction(
            env, "up", settings, lambda _: self.arrived.append(env.now), self.records.append, rng
        )

        def sender():
            for t_s, size, *more in sends:
                yield env.timeout(t_s - env.now)
                priority, topic = (*more, *(0, "chat")[len(more) :])
                link.send(topic, b"x" * size, priority=priority)

        def switcher():
            for t_s, rate_bps in switch:
                yield env.timeout(t_s - env.now)
                link.switch_rate(rate_bps)

        env.process(sender())
        env.process(switcher())
        env.run(until=until_s)
        link.close()

    @property
    def packets(self):
        ended = (r for r in self.records if isinstance(r, PacketEnded))
        return sorted(ended, key=lambda p: p.packet)

    @property
    def fates(self):
        return [p.reason or p.outcome for p in self.packets]

    @property
    def times(self):
        """When each arrived, by number."""
        return [p.arrived_s for p in self.packets]


def waits(p):
    return (p.queue_s, p.serialisation_s, p.blackout_s, p.propagation_s, p.retransmission_s)


# Rates ----------------------------------------------------------------------------------------------------------------


def test_a_rate_that_changes_in_mid_packet():
    # 32 bits: 16 in 2 s at 8 bit/s, 16 in 4 s at 4 bit/s; then 8 more in 2 s.
    run = Run(DirectionSettings(1.0, 10.0, rates=((0.0, 8.0), (2.0, 4.0))), [(0.0, 4), (0.0, 1)])
    assert run.times == [16.0, 18.0]
    assert waits(run.packets[1]) == (6.0, 2.0, 0.0, 10.0, 0.0)


def test_a_rate_switched_by_hand_counts_from_then_on_and_puts_away_the_schedule():
    # 16 bits in 2 s, then 1 bit/s until 6 s: 4 more; then 6 s for the last 12 at 2 bit/s. The 100 bit/s never come.
    settings = DirectionSettings(1.0, 0.0, rates=((0.0, 8.0), (50.0, 100.0)))
    run = Run(settings, [(0.0, 4), (60.0, 1)], switch=((2.0, 1.0), (6.0, 2.0)))
    assert run.times == [12.0, 64.0]


def test_a_switch_while_idle_and_to_no_serialisation_at_all():
    settings = DirectionSettings(1.0, 0.5, rates=((0.0, 8.0),))
    run = Run(settings, [(0.0, 1), (5.0, 1), (6.0, 100)], switch=((3.0, 4.0), (6.5, math.inf)))
    # The second took 2 s from 5 s: at 6.5 s the rest of it and all behind it are out.
    assert run.times == [1.5, 7.0, 7.0]


def test_only_a_direction_that_says_so_can_be_switched():
    for settings in (DirectionSettings(8.0, 1.0), DirectionSettings(8.0, 1.0, queue_limit=3)):
        with pytest.raises(BadInput, match="one rate for good"):
            Run(settings, [], 2.0, switch=((1.0, 9.0),))
    with pytest.raises(BadInput, match="delivers nothing"):
        Run(DirectionSettings(8.0, 1.0, rates=((0.0, 8.0),)), [], 2.0, switch=((1.0, 0.0),))


# Priorities and fragments ---------------------------------------------------------------------------------------------


def test_an_urgent_packet_waits_for_the_fragment_under_way_and_the_rest_keeps_its_place():
    # Fragments of 2 bytes, 2 s each: the urgent one of 1 s comes in the first and goes at 2 s.
    settings = DirectionSettings(8.0, 10.0, mtu_bytes=2, discipline="priority")
    run = Run(settings, [(0.0, 6, 0), (0.0, 2, 0), (1.0, 1, 9)])
    assert run.times == [17.0, 19.0, 13.0]
    assert [waits(p)[:2] for p in run.packets] == [(1.0, 6.0), (7.0, 2.0), (1.0, 1.0)]
    assert [p.priority for p in run.packets] == [0, 0, 9]


def test_without_fragments_nothing_gives_way():
    run = Run(DirectionSettings(8.0, 10.0, discipline="priority"), [(0.0, 6, 0), (0.0, 2, 0), (1.0, 1, 9)])
    assert run.times == [16.0, 19.0, 17.0]


def test_every_fragment_has_its_header():
    # 5 bytes in fragments of 3, of which 1 is a header: 2 + 2 + 1 bytes in 3 + 3 + 2.
    run = Run(DirectionSettings(8.0, 10.0, header_bytes=1, mtu_bytes=3), [(0.0, 5)])
    assert run.packets[0].size_bits == 64
    assert run.times == [18.0]


def test_newest_state_wins_in_the_place_of_the_older():
    settings = DirectionSettings(8.0, 0.0, discipline="newest")
    run = Run(settings, [(0.0, 5, 0, "a"), (1.0, 1, 0, "b"), (2.0, 1, 0, "c"), (3.0, 2, 0, "b"), (4.0, 1, 0, "a")])
    assert run.fates == ["delivered", "superseded", "delivered", "delivered", "delivered"]
    # The newer b goes ahead of c, for 2 s from 5 s.
    assert [run.times[i] for i in (0, 2, 3, 4)] == [5.0, 8.0, 7.0, 9.0]
    assert (run.packets[1].t_s, waits(run.packets[1])) == (3.0, (2.0, 0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(("drop", "gone"), [("tail", [3, 4]), ("head", [1, 2])])
def test_a_full_queue_drops_its_tail_or_its_head(drop, gone):
    run = Run(DirectionSettings(8.0, 1.0, queue_limit=2, drop=drop), [(0.0, 1)] * 5)
    assert [i for i, fate in enumerate(run.fates) if fate == "queue_full"] == gone
    assert sorted(t for t in run.times if not math.isnan(t)) == [2.0, 3.0, 4.0]
    assert run.link.counters.total.dropped == {"queue_full": 2}


# Budgets --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("budget_bits", "fates"), [(96, ["delivered"] * 3), (95, ["delivered"] * 2 + ["budget"])])
def test_a_budget_runs_out_at_the_very_bit_headers_included(budget_bits, fates):
    # 3 x (2 + 2) bytes are 96 bits.
    run = Run(DirectionSettings(math.inf, 0.5, header_bytes=2, budget_bits=budget_bits), [(0.0, 2)] * 3)
    assert run.fates == fates


# osrf/cloudsim-legacy @01ea7dd yaml/tasks_dress_rehearsal.yaml: uplink bits of the VRC's five runs.
@pytest.mark.parametrize("budget_bits", [29_491_200, 7_372_800, 1_843_200, 460_800, 115_200])
def test_every_budget_of_the_vrc_runs_out_at_the_right_bit(budget_bits):
    sends = [(0.0, budget_bits // 8 - 29), (1.0, 2), (2.0, 1), (3.0, 0)]
    run = Run(DirectionSettings(math.inf, 0.5, header_bytes=14, budget_bits=budget_bits), sends)
    # The first leaves 15 bytes: 14 of header and one of payload.
    assert run.fates == ["delivered", "budget", "delivered", "budget"]
    assert run.link.delivered_bits == budget_bits


def test_what_is_left_of_a_budget_serves_a_smaller_packet():
    run = Run(DirectionSettings(math.inf, 0.0, budget_bits=80), [(0.0, 8), (1.0, 3), (2.0, 2), (3.0, 1)])
    assert run.fates == ["delivered", "budget", "delivered", "budget"]
    assert run.packets[1].t_s == 1.0


# Blackouts ------------------------------------------------------------------------------------------------------------

DARK = ((6.0, 20.0),)


def test_a_fragment_cut_by_the_dark_goes_on_after_it():
    run = Run(DirectionSettings(8.0, 10.0, blackouts=DARK, mtu_bytes=100), [(2.0, 8)])
    assert run.times == [34.0]
    assert waits(run.packets[0]) == (0.0, 8.0, 14.0, 10.0, 0.0)


def test_a_fragment_cut_by_the_dark_starts_again():
    run = Run(DirectionSettings(8.0, 10.0, blackouts=DARK, on_dark="restart"), [(2.0, 8), (2.0, 1)])
    assert run.times == [38.0, 39.0]
    assert waits(run.packets[0]) == (0.0, 8.0, 14.0, 10.0, 4.0)
    assert waits(run.packets[1]) == (12.0, 1.0, 14.0, 10.0, 0.0)


def test_only_the_fragment_cut_by_the_dark_starts_again():
    # Fragments of 3 s: one is out at 5 s, the next is cut after 1 s.
    run = Run(DirectionSettings(8.0, 10.0, blackouts=DARK, on_dark="restart", mtu_bytes=3), [(2.0, 6)])
    assert run.times == [33.0]
    assert waits(run.packets[0]) == (0.0, 6.0, 14.0, 10.0, 1.0)


def test_a_packet_cut_by_the_dark_is_lost_then():
    run = Run(DirectionSettings(8.0, 10.0, blackouts=DARK, on_dark="lose"), [(2.0, 8), (2.0, 1)])
    assert run.fates == ["blackout", "delivered"]
    assert (run.packets[0].t_s, waits(run.packets[0])) == (6.0, (0.0, 4.0, 0.0, 0.0, 0.0))
    assert run.times[1] == 31.0


@pytest.mark.parametrize("on_dark", ["pause", "restart", "lose"])
def test_a_last_bit_that_leaves_as_it_gets_dark_is_out(on_dark):
    run = Run(DirectionSettings(8.0, 10.0, blackouts=DARK, on_dark=on_dark, mtu_bytes=100), [(2.0, 4)])
    assert run.times == [16.0]
    assert run.records[0] == Blackout(6.0, "up", True)


@pytest.mark.parametrize("on_dark", ["restart", "lose", "pause"])
def test_what_is_offered_in_the_dark_goes_out_in_the_light_the_most_urgent_first(on_dark):
    settings = DirectionSettings(8.0, 10.0, blackouts=DARK, on_dark=on_dark, discipline="priority")
    run = Run(settings, [(7.0, 1, 0), (8.0, 1, 1)])
    assert run.times == [32.0, 31.0]
    assert [p.service_s for p in run.packets] == [21.0, 20.0]
    assert waits(run.packets[0]) == (1.0, 1.0, 13.0, 10.0, 0.0)


def test_bits_in_the_air_are_lost_as_it_gets_dark():
    # Out at 2, 3 and 4 s, 3 s in the air: the last bit of the second arrives as it gets dark, which is in time.
    settings = DirectionSettings(8.0, 3.0, blackouts=DARK, on_dark_flight="lose")
    run = Run(settings, [(1.0, 1), (2.0, 1), (3.0, 1), (4.0, 4), (30.0, 1)])
    assert run.fates == ["delivered", "delivered", "blackout", "blackout", "delivered"]
    # The record is written when it would have arrived.
    assert [p.t_s for p in run.packets] == [5.0, 6.0, 7.0, 25.0, 34.0]


def test_without_delay_no_bit_is_in_the_air():
    run = Run(DirectionSettings(8.0, 0.0, blackouts=DARK, on_dark_flight="lose"), [(4.0, 4)])
    assert run.times == [22.0]


def test_the_first_fragment_in_the_air_counts_too():
    # It is out at 6 s and in the air as it gets dark; the second goes out and arrives in the light.
    settings = DirectionSettings(8.0, 1.0, blackouts=DARK, on_dark_flight="lose", mtu_bytes=1)
    assert Run(settings, [(5.0, 2)]).fates == ["blackout"]


@pytest.mark.parametrize("on_dark", ["pause", "restart", "lose"])
def test_a_direction_that_stays_dark_neither_delivers_nor_hangs(on_dark):
    settings = DirectionSettings(8.0, 1.0, blackouts=((3.0, math.inf),), on_dark=on_dark, queue_limit=9)
    run = Run(settings, [(1.0, 1), (1.0, 4), (5.0, 1)], 100.0)
    assert run.fates[::2] == ["delivered", "in_flight"]
    assert run.fates[1] == ("blackout" if on_dark == "lose" else "in_flight")
    assert run.packets[2].blackout_s == 95.0
    assert run.link.utilisation() == pytest.approx(0.02, abs=1e-12)


@pytest.mark.parametrize("on_dark", ["restart", "lose"])
def test_rounding_decides_no_fate(on_dark):
    # Ten times 0.1 s is 1 - 1.1e-16 s: the eleventh does not begin in the rest of the light.
    assert sum([0.1] * 10) < 1.0
    run = Run(DirectionSettings(80.0, 0.0, blackouts=((1.0, 2.0),), on_dark=on_dark), [(0.0, 1)] * 11)
    assert run.fates == ["delivered"] * 11
    assert run.packets[10].service_s == 2.0
    assert run.packets[10].retransmission_s == 0.0
    # Three times 0.1 s is 0.3 + 5.6e-17 s: the third is out in time.
    assert sum([0.1] * 3) > 0.3
    run = Run(DirectionSettings(80.0, 0.0, blackouts=((0.3, 2.0),), on_dark=on_dark), [(0.0, 1)] * 3)
    assert run.times == pytest.approx([0.1, 0.2, 0.3], rel=0, abs=TOLERANCE_S)
    # Out at 0.2 s, in the air for 0.1 s.
    run = Run(DirectionSettings(80.0, 0.1, blackouts=((0.3, 2.0),), on_dark=on_dark, on_dark_flight="lose"), [(0.1, 1)])
    assert run.fates == ["delivered"]


# Order, jitter, loss --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("reorder", "times"), [(False, [6.0, 6.0, 8.0]), (True, [6.0, 2.0, 8.0])])
def test_a_packet_with_less_jitter_waits_unless_it_may_overtake(reorder, times):
    # Out at 1, 2 and 3 s, with no delay but 5, 0 and 5 s of jitter.
    run = Run(DirectionSettings(8.0, 0.0, jitter=Draws([5.0, 0.0, 5.0]), reorder=reorder), [(0.0, 1)] * 3)
    assert run.times == times
    assert run.arrived == sorted(times)


def test_a_lost_packet_holds_nobody_up():
    settings = DirectionSettings(8.0, 1.0, blackouts=DARK, on_dark_flight="lose", jitter=Draws([20.0, 0.0]))
    run = Run(settings, [(3.0, 1), (3.0, 1)])
    assert (run.fates, run.times[1]) == (["blackout", "delivered"], 6.0)


def test_one_lost_fragment_loses_the_packet_and_the_others_go_out_all_the_same():
    run = Run(DirectionSettings(8.0, 1.0, mtu_bytes=1, loss=Losses([False, True, False, False])), [(0.0, 3), (0.0, 1)])
    assert run.fates == ["lost", "delivered"]
    assert (run.packets[0].t_s, run.times[1]) == (4.0, 5.0)


def test_every_fragment_takes_its_draws_whatever_became_of_the_others():
    # The second of four is lost; the state moves on with each: the fifth, of the next packet, is the first to be good.
    losses = Losses([False, True, True, False, False])
    run = Run(DirectionSettings(8.0, 1.0, mtu_bytes=1, loss=losses), [(0.0, 4), (0.0, 1)])
    assert (run.fates, losses.left) == (["lost", "delivered"], [])


def test_loss_comes_in_bursts_over_packets():
    # Enters at once, never leaves: all lost.
    run = Run(DirectionSettings(8.0, 1.0, loss=GilbertElliott(1.0, 1.0)), [(0.0, 1)] * 4)
    assert run.fates == ["lost", "delivered", "lost", "delivered"]


def test_the_draws_of_loss_and_jitter_do_not_shift_each_other():
    sends = [(float(t), 1) for t in range(200)]
    plain, jitter = DirectionSettings(80.0, 1.0, loss=Bernoulli(0.3)), UniformJitter(0.0, 5.0)
    runs = [
        Run(settings, sends)
        for settings in (
            plain,
            DirectionSettings(80.0, 1.0, loss=Bernoulli(0.3), jitter=jitter, reorder=True),
            DirectionSettings(80.0, 1.0, jitter=jitter, reorder=True),
        )
    ]
    assert runs[0].fates == runs[1].fates
    kept = [i for i, fate in enumerate(runs[1].fates) if fate == "delivered"]
    assert [runs[1].times[i] for i in kept] == [runs[2].times[i] for i in kept]
    # 200 draws: 4 sigma is 0.13.
    assert len(kept) / 200 == pytest.approx(0.7, abs=0.13)


def test_chance_without_a_generator_is_refused():
    for settings in (
        DirectionSettings(8.0, 1.0, loss=Bernoulli(0.1)),
        DirectionSettings(8.0, 1.0, jitter=EmpiricalJitter((0.1,))),
    ):
        with pytest.raises(BadInput, match="random numbers"):
            Direction(simpy.Environment(), "up", settings, lambda _: None, lambda _: None)


# The end, and what is refused -----------------------------------------------------------------------------------------


def test_closing_ends_all_that_is_on_its_way_once():
    # Fragments of 2 s. At 9 s: 0 in the air since 4 s, 1 half out, 2 waits; 3 was dropped.
    settings = DirectionSettings(8.0, 10.0, mtu_bytes=2, queue_limit=2)
    run = Run(settings, [(0.0, 4), (0.0, 8), (0.0, 4), (0.0, 4)], 9.0)
    assert run.fates == ["in_flight", "in_flight", "in_flight", "queue_full"]
    assert [waits(p) for p in run.packets] == [
        (0.0, 4.0, 0.0, 5.0, 0.0),
        (4.0, 5.0, 0.0, 0.0, 0.0),
        (9.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ]
    assert run.link.utilisation() == 1.0
    run.link.close()
    assert len(run.packets) == 4
    with pytest.raises(LinkClosed, match="after close"):
        run.link.send("chat", b"late")


def test_who_hears_of_a_drop_may_send_at_once():
    env = simpy.Environment()
    ended = []

    def resend(record):
        if isinstance(record, PacketEnded):
            ended.append((record.reason or record.outcome, env.now))
            if record.reason == "blackout":
                link.send("again", b"x")

    settings = DirectionSettings(8.0, 1.0, blackouts=DARK, on_dark="lose", budget_bits=80)
    link = Direction(env, "up", settings, lambda _: None, resend)
    link.send("chat", b"x" * 9)
    link.send("chat", b"x" * 8)
    env.run()
    # Of 80 bits the first took 72; the second is over budget, and the one sent again takes the last 8.
    assert ended == [("blackout", 6.0), ("budget", 20.0), ("delivered", 22.0)]


@pytest.mark.parametrize(
    ("where", "settings"),
    [
        ("jitter", {"jitter": UniformJitter(-2.0, 0.0)}),
        ("queue_limit", {"queue_limit": -1}),
        ("budget_bits", {"budget_bits": 320}),
        ("budget_bits", {"budget_bits": math.nan}),
        ("mtu_bytes", {"mtu_bytes": 40}),
        ("mtu_bytes", {"mtu_bytes": -1}),
        ("rates[0]", {"rates": ((0.0, 0.0),)}),
        ("on_dark", {"on_dark": "wait"}),
        ("on_dark_flight", {"on_dark_flight": "los"}),
        ("discipline", {"discipline": "lifo"}),
        ("drop", {"drop": "middle"}),
    ],
)
def test_what_delivers_nothing_or_is_unknown_is_named(where, settings):
    with pytest.raises(BadInput) as refused:
        DirectionSettings(8.0, 1.0, header_bytes=40, **settings)
    assert [p.where for p in refused.value.problems] == [where]
    assert all(p.hint for p in refused.value.problems)
    assert pickle.loads(pickle.dumps(refused.value)).args == refused.value.args


def test_only_what_is_known_when_offered_is_neutral():
    assert DirectionSettings(8.0, 1.0, 40, ((1.0, 2.0),), reorder=True).neutral
    for more in ({"queue_limit": 1}, {"loss": Bernoulli(0.1)}, {"mtu_bytes": 9}, {"rates": ((0.0, 1.0),)}):
        assert not DirectionSettings(8.0, 1.0, **more).neutral
