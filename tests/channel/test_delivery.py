"""Deliveries: closed forms, what a give-up and a blackout do, what goes on the wire."""

from __future__ import annotations

import math
import pickle

import pytest
import simpy

from teleop_sim.channel.arq import (
    ACK,
    DATA,
    PLAIN,
    SKIP,
    WINDOW_MAX,
    Frame,
    timeout_for,
    unpack_frame,
    window_for,
)
from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.custody import ack_due_s
from teleop_sim.channel.delivery import (
    DELIVERIES,
    BestEffort,
    Custody,
    Fate,
    SelectiveRepeat,
    StopAndWait,
    Tcp,
)
from teleop_sim.channel.fates import Book
from teleop_sim.channel.halves import Receiver, Sender
from teleop_sim.channel.jitter import UniformJitter
from teleop_sim.channel.link import DirectionSettings, LinkClosed
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.core.errors import BadInput

# Times stay below 1e5 s, where a double resolves 2e-11 s; a time is a sum of some tens of such numbers.
TOLERANCE_S = 1e-9

SRC_UP, SRC_DOWN = DirectionSettings(64.0, 10.0), DirectionSettings(50_000.0, 10.0)


def test_best_effort_adds_nothing_and_its_fates_are_those_of_its_packets(talk):
    s = talk.story(BestEffort(), up=DirectionSettings(64.0, 10.0, blackouts=((20.0, math.inf),)))
    for _ in range(10):
        s.link.station.send("chat", b"x" * 18, "said")
    s.until(100.0)
    # 2.25 s each: eight are out by 18 s; the ninth is caught by the dark at 20 s.
    assert s.got == [(12.25 + 2.25 * i, b"x" * 18) for i in range(8)]
    assert {p.size_bits for p in s.packets} == {144}
    assert [f.outcome for f in s.fates] == ["delivered"] * 8 + ["in_flight"] * 2
    assert s.fates[1] == Fate(1, "chat", 18, "delivered", "", 1, 0.0, 14.5, 0.0, 0.0, 14.5, 0.0, "said", 1)
    assert (s.link.station.book.offered, s.link.station.book.delivered, s.link.station.book.gave_up) == (10, 8, 0)


def test_the_time_out_suits_a_round_trip_of_20_s():
    # (18 + 3) * 8 / 64 + 10 + 3 * 8 / 50000 + 10 = 22.62548 s, and a tenth.
    assert timeout_for(SRC_UP, SRC_DOWN, 18) == pytest.approx(24.888028, abs=TOLERANCE_S)
    # Nothing to wait for: the least margin.
    free = DirectionSettings(math.inf, 0.0)
    assert timeout_for(free, free, 1000) == 0.01


def test_the_time_out_counts_fragments_the_slowest_rate_and_the_widest_jitter():
    out = DirectionSettings(
        64.0, 1.0, 4, mtu_bytes=12, rates=((0.0, 80.0), (9.0, 40.0)), jitter=UniformJitter(0.5, 3.0)
    )
    back = DirectionSettings(80.0, 1.0)
    # 17 + 3 bytes in pieces of 8: 12 + 12 + 8 bytes, 6.4 s; up to 4 s across; 0.3 s and 1 s back; a tenth.
    assert timeout_for(out, back, 17) == pytest.approx(11.7 * 1.1, abs=TOLERANCE_S)
    # Custody knows the schedule: 80 bit/s to the end.
    assert ack_due_s(0.0, 17, out, back) == pytest.approx(3.2 + 4.0 + 0.3 + 1.0 + 1.17, abs=TOLERANCE_S)
    assert window_for(out, back, 17) == 2
    assert window_for(DirectionSettings(math.inf, 1.0), back, 17) == WINDOW_MAX


def test_stop_and_wait_without_loss_sends_one_payload_a_cycle(talk):
    s = talk.story(StopAndWait())
    for i in range(20):
        s.link.station.send("chat", bytes([i]) * 18)
    s.until(1000.0)
    # Payload over round trip and both serialisations (Bertsekas & Gallager, section 2.4.1, without errors).
    cycle_s = 21 * 8 / 64 + 10.0 + 3 * 8 / 50_000 + 10.0
    assert [t for t, _ in s.got] == pytest.approx(
        [i * cycle_s + 21 * 8 / 64 + 10.0 for i in range(20)], abs=TOLERANCE_S
    )
    assert [data for _, data in s.got] == [bytes([i]) * 18 for i in range(20)]
    assert [t for t, _, ok in s.news if ok] == pytest.approx([(i + 1) * cycle_s for i in range(20)], abs=TOLERANCE_S)
    assert len(s.packets) == 40


def test_a_lost_copy_costs_one_time_out_and_the_account_says_so(talk):
    s = talk.story(StopAndWait(timeout_s=30.0), lose_up=talk.These(0, 1))
    s.link.station.send("chat", b"x" * 18, "said")
    s.until(200.0)
    assert s.got == [(60.0 + 12.625, b"x" * 18)]
    assert s.fates == [Fate(0, "chat", 18, "delivered", "", 3, 0.0, 72.625, 0.0, 60.0, 12.625, 0.0, "said", 2)]


def test_a_lost_acknowledgement_makes_a_copy_that_the_application_never_sees(talk):
    s = talk.story(StopAndWait(timeout_s=30.0), lose_down=talk.These(0))
    s.link.station.send("chat", b"x")
    s.link.station.send("chat", b"y")
    s.until(200.0)
    assert [data for _, data in s.got] == [b"x", b"y"]
    assert [p.topic for p in s.packets if p.direction == "up"] == ["chat"] * 3
    # The first copy is the one that arrived.
    assert [f.retransmission_s for f in s.fates] == [0.0, 0.0]


def test_stop_and_wait_gives_up_after_its_tries_and_goes_on(talk):
    s = talk.story(StopAndWait(timeout_s=30.0, tries=2), lose_up=talk.These(0, 1))
    s.link.station.send("chat", b"x")
    s.link.station.send("chat", b"y")
    s.until(200.0)
    assert [data for _, data in s.got] == [b"y"]
    assert [(f.number, f.outcome, f.reason, f.tries, f.ended_s) for f in s.fates[:1]] == [
        (0, "gave_up", "gave_up", 2, 60.0)
    ]
    assert [(n, ok) for _, n, ok in s.news] == [(0, False), (1, True)]
    assert s.news[0][0] == 60.0


def test_a_copy_that_comes_after_the_give_up_is_still_delivered(talk):
    # A time-out far too short: the sender gives up at 2 s what arrives at 10.5 s.
    s = talk.story(StopAndWait(timeout_s=1.0, tries=2))
    s.link.station.send("chat", b"x")
    s.until(100.0)
    assert [(f.outcome, f.ended_s) for f in s.fates] == [("delivered", 10.5)]
    assert [ok for _, _, ok in s.news] == [False]


def test_selective_repeat_with_a_window_of_the_round_trip_keeps_the_link_full(talk):
    up, down = DirectionSettings(64.0, 10.0), DirectionSettings(64.0, 10.0)
    # 20 bytes with their frame: 2.5 s; a cycle of 2.5 + 10 + 0.375 + 10 = 22.875 s holds 9.15 of them.
    window = window_for(up, down, 17)
    assert window == 10
    s = talk.story(SelectiveRepeat(window), up, down)
    for i in range(100):
        s.link.station.send("chat", bytes([i]) * 17)
    s.until(100 * 2.5)
    assert s.link.up.utilisation() == pytest.approx(1.0, abs=TOLERANCE_S)
    assert [t for t, _ in s.got] == pytest.approx([2.5 * (i + 1) + 10.0 for i in range(95)], abs=TOLERANCE_S)
    assert len([p for p in s.packets if p.direction == "up"]) == 100


@pytest.mark.parametrize("window", [1, 2, 5, 9])
def test_a_narrower_window_sends_a_window_a_cycle(talk, window):
    up, down = DirectionSettings(64.0, 10.0), DirectionSettings(64.0, 10.0)
    s = talk.story(SelectiveRepeat(window), up, down)
    for i in range(60):
        s.link.station.send("chat", bytes([i]) * 17)
    cycles = 60 // window
    s.until(22.875 * cycles)
    assert s.link.up.utilisation() == pytest.approx(window * 2.5 / 22.875, abs=TOLERANCE_S)


def test_selective_repeat_repeats_only_what_was_lost_and_keeps_order(talk):
    s = talk.story(SelectiveRepeat(8, timeout_s=30.0), lose_up=talk.These(1))
    for name in (b"a", b"b", b"c"):
        s.link.station.send("chat", name)
    s.until(200.0)
    # 4 bytes: 0.5 s each. The second copy of b goes 30 s after the turn of the first at 0.5 s.
    assert s.got == [(10.5, b"a"), (41.0, b"b"), (41.0, b"c")]
    assert [p.text for p in s.packets if p.topic == "ack"] == ["ack 0", "ack 2", "ack 1"]
    assert len([p for p in s.packets if p.direction == "up"]) == 4
    assert [(f.retransmission_s, f.link_s, f.order_s) for f in s.fates] == [
        (0.0, 10.5, 0.0),
        (30.5, 10.5, 0.0),
        (0.0, 11.5, 29.5),
    ]


def test_selective_repeat_skips_what_it_gives_up_so_that_the_rest_gets_through(talk):
    s = talk.story(SelectiveRepeat(8, timeout_s=30.0, tries=1), lose_up=talk.These(0, 3))
    for name in (b"a", b"b", b"c"):
        s.link.station.send("chat", name)
    s.until(300.0)
    # The first skip, at 30 s, is lost too; the next goes at 60 s and takes 3 bytes: 0.375 s.
    assert s.got == [(70.375, b"b"), (70.375, b"c")]
    assert [(f.number, f.outcome, f.ended_s) for f in s.fates] == [
        (0, "gave_up", 30.0),
        (1, "delivered", 70.375),
        (2, "delivered", 70.375),
    ]
    assert s.link.station.book.in_flight == 0


def test_custody_offers_nothing_in_the_dark_and_resumes_at_first_light(talk):
    dark = ((5.0, 1000.0), (1010.0, 1020.0))
    s = talk.story(Custody(), up=DirectionSettings(64.0, 10.0, blackouts=dark))
    s.env.run(until=7.0)
    s.link.station.send("chat", b"x")
    s.until(2000.0)
    assert s.got == [(1010.5, b"x")]
    (packet,) = [p for p in s.packets if p.direction == "up"]
    assert (packet.sent_s, packet.blackout_s) == (1000.0, 0.0)
    assert [(f.store_s, f.retransmission_s, f.link_s) for f in s.fates] == [(993.0, 0.0, 10.5)]


def test_custody_never_gives_up_and_repeats_only_in_the_light(talk):
    # Contacts of 60 s a quarter of an hour apart; the first three copies are lost.
    dark = tuple((900.0 * i + 60.0, 900.0 * (i + 1)) for i in range(10))
    up = DirectionSettings(64.0, 10.0, blackouts=dark)
    down = DirectionSettings(50_000.0, 10.0, blackouts=dark)
    s = talk.story(Custody(), up, down, lose_up=talk.These(0, 1, 2))
    s.link.station.send("chat", b"x")
    s.until(9000.0)
    assert [data for _, data in s.got] == [b"x"]
    sent = [p.sent_s for p in s.packets if p.direction == "up"]
    due_s = timeout_for(up, down, 1)
    assert sent == pytest.approx([0.0, due_s, 2 * due_s, 900.0], abs=TOLERANCE_S)
    assert [f.tries for f in s.fates] == [4]


def test_an_acknowledgement_that_must_wait_for_light_is_waited_for(talk):
    down = DirectionSettings(50_000.0, 10.0, blackouts=((5.0, 500.0),))
    s = talk.story(Custody(), down=down)
    s.link.station.send("chat", b"x")
    s.until(2000.0)
    assert len([p for p in s.packets if p.direction == "up"]) == 1
    assert s.news == [(pytest.approx(510.00048, abs=TOLERANCE_S), 0, True)]


def test_without_blackouts_custody_waits_as_the_others_do():
    assert ack_due_s(7.0, 18, SRC_UP, SRC_DOWN) == pytest.approx(7.0 + timeout_for(SRC_UP, SRC_DOWN, 18))


def test_custody_on_a_link_that_stays_dark_keeps_the_message_and_lets_the_clock_end(talk):
    s = talk.story(Custody(), up=DirectionSettings(64.0, 10.0, blackouts=((0.0, math.inf),)))
    s.link.station.send("chat", b"x")
    s.env.run()
    s.link.close()
    assert (s.env.now, s.packets, [f.outcome for f in s.fates]) == (0.0, [], ["in_flight"])


def test_both_sites_may_send_with_different_deliveries(talk):
    s = talk.story(StopAndWait(), back=SelectiveRepeat(4))
    s.link.station.send("chat", b"up")
    for i in range(3):
        s.link.site.send("log", bytes([i]))
    s.until(100.0)
    assert [data for _, data in s.got] == [b"up"]
    assert [data for _, data in s.station.got] == [b"\x00", b"\x01", b"\x02"]


def test_best_effort_against_an_acknowledged_direction_costs_a_flag_byte(talk):
    s = talk.story(StopAndWait())
    s.link.site.send("log", b"abc")
    s.until(50.0)
    assert [p.payload_bytes for p in s.packets] == [4]
    assert [data for _, data in s.station.got] == [b"abc"]


@pytest.mark.parametrize(("ack_priority", "heard_s"), [(0, 52.625), (1, 23.375)])
def test_urgent_acknowledgements_need_not_wait_behind_pictures(talk, ack_priority, heard_s):
    # 13 pictures of 25 bytes, 26 with their flag, take 3.25 s each, 42.25 s together. The acknowledgement is offered at
    # 10.5 s, takes 0.375 s, and goes when the fourth picture is out, at 13 s, or after all of them.
    down = DirectionSettings(64.0, 10.0, discipline="priority")
    s = talk.story(StopAndWait(timeout_s=100.0), down=down, ack_priority=ack_priority)
    for _ in range(13):
        s.link.site.send("image", b"x" * 25)
    s.link.station.send("chat", b"x")
    s.until(200.0)
    assert s.news == [(heard_s, 0, True)]


@pytest.mark.parametrize("p", [0.1, 0.3])
def test_stop_and_wait_with_loss_has_the_efficiency_of_the_book(talk, p):
    # A try succeeds if data and acknowledgement do: (1 - p)^2 (Bertsekas & Gallager, section 2.4.1, their q).
    # With the time-out at a cycle plus a hair, a message takes 1 / (1 - p)^2 cycles.
    up = down = DirectionSettings(800.0, 1.0)
    cycle_s = 2 * 1.0 + 8 * 10 / 800.0 + 8 * 3 / 800.0
    s = talk.story(
        StopAndWait(timeout_s=cycle_s * (1 + 1e-9), tries=math.inf),
        up,
        down,
        Bernoulli(p),
        Bernoulli(p),
    )
    for _ in range(4000):
        s.link.station.send("chat", b"x" * 7)
    s.env.run()
    end_s = s.news[-1][0]
    q = (1 - p) ** 2
    # Tries are geometric: deviation of their mean sqrt(1 - q) / q / sqrt(4000); four of them.
    off = 4 * math.sqrt(1 - q) / math.sqrt(4000)
    assert 4000 * cycle_s / end_s == pytest.approx(q, rel=off)
    assert len(s.got) == 4000


def test_selective_repeat_with_loss_uses_the_share_that_is_not_lost(talk):
    # Ideal selective repeat: efficiency 1 - p (Bertsekas & Gallager, section 2.4.3); only lost data is repeated.
    up, down = DirectionSettings(800.0, 1.0), DirectionSettings(800.0, 1.0)
    p, n = 0.2, 4000
    s = talk.story(SelectiveRepeat(2000, tries=math.inf), up, down, Bernoulli(p))
    for _ in range(n):
        s.link.station.send("chat", b"x" * 7)
    s.env.run()
    copies = len([r for r in s.packets if r.direction == "up"])
    # Copies a message are geometric; four deviations of their mean.
    assert n / copies == pytest.approx(1 - p, rel=4 * math.sqrt(p / n))
    assert len(s.got) == n


@pytest.mark.parametrize("window", [1, 300, WINDOW_MAX])
def test_numbers_wrap_and_stay_in_order(window):
    # The halves alone, with a list for a link that loses every third frame: numbers start just below the wrap.
    env, wire, news = simpy.Environment(), [], []

    def transmit(topic, frame, text, priority, copy_of):
        wire.append(frame)
        return env.now

    first, n = 2 * WINDOW_MAX - 200, 600
    book = Book(env, lambda _: None, best_effort=False)
    by = SelectiveRepeat(window, timeout_s=1.0, tries=math.inf)
    sender = Sender(env, by, (SRC_UP, SRC_DOWN), transmit, book, lambda number, _: news.append(number))
    receiver = Receiver(window, in_order=True)
    receiver.expected = first
    for i in range(n):
        sender.offer(first + i, "chat", i.to_bytes(2, "big"), "", 0)
    got, crossed = [], 0
    while len(news) < n:
        frames, wire[:] = wire[:], []
        for frame in frames:
            crossed += 1
            if crossed % 3:
                got += [int.from_bytes(taken.payload, "big") for taken in receiver.take(frame)[0]]
                sender.acknowledge(frame.number)
        env.run(until=env.now + 1.0)
    assert got == list(range(n))
    assert sorted(news) == list(range(first, first + n))


def test_a_sender_that_hears_nothing_stops_before_its_numbers_would_look_old():
    env, sent = simpy.Environment(), set()

    def transmit(topic, frame, text, priority, copy_of):
        sent.add(copy_of)
        return env.now

    book = Book(env, lambda _: None, best_effort=False)
    sender = Sender(env, StopAndWait(1.0, 1), (SRC_UP, SRC_DOWN), transmit, book, lambda *_: None)
    for i in range(WINDOW_MAX + 10):
        sender.offer(i, "chat", b"", "", 0)
    env.run(until=WINDOW_MAX + 100.0)
    receiver = Receiver(1, in_order=True)
    (taken,), over = receiver.take(Frame(DATA, max(sent)))
    assert (taken.number, len(over)) == (WINDOW_MAX - 1, WINDOW_MAX - 1)


def test_a_receiver_that_missed_numbers_knows_by_the_window_that_they_are_over():
    receiver = Receiver(window=4, in_order=True)
    assert receiver.take(Frame(DATA, 2, b"c")) == ((), ())
    taken, over = receiver.take(Frame(DATA, 6, b"g"))
    assert ([t.payload for t in taken], over, receiver.expected) == ([b"c"], (0, 1), 3)


@pytest.mark.parametrize(
    "frame",
    [Frame(DATA, 65535, b"payload"), Frame(DATA), Frame(ACK, 7), Frame(SKIP, 9), Frame(PLAIN, payload=b"a")],
)
def test_frames_come_back_from_their_bytes(frame):
    data = frame.pack()
    assert unpack_frame(data) == frame
    assert len(data) == (1 if frame.kind == PLAIN else 3) + len(frame.payload)


@pytest.mark.parametrize("data", [b"", b"\x01\x00", b"\x02\x00\x01x", b"\x03", b"\x11\x00\x00"])
def test_bytes_that_are_no_frame_are_refused(data):
    with pytest.raises(BadMessage, match="same deliveries"):
        unpack_frame(data)


def test_a_message_after_close_is_refused(talk):
    s = talk.story(StopAndWait()).until(1.0)
    with pytest.raises(LinkClosed):
        s.link.station.send("chat", b"late")


@pytest.mark.parametrize("name", sorted(DELIVERIES))
def test_every_delivery_delivers_once_on_a_link_without_loss(talk, name):
    s = talk.story(DELIVERIES[name]())
    for i in range(5):
        s.link.station.send("chat", bytes([i]))
    s.until(500.0)
    assert [data for _, data in s.got] == [bytes([i]) for i in range(5)]
    assert [f.outcome for f in s.fates] == ["delivered"] * 5


@pytest.mark.parametrize("make", [StopAndWait, SelectiveRepeat, Custody])
@pytest.mark.parametrize(
    ("field_name", "value"), [("timeout_s", 0.0), ("timeout_s", math.inf), ("tries", 0), ("tries", 1.5)]
)
def test_deliveries_that_cannot_work_are_refused(make, field_name, value):
    with pytest.raises(BadInput) as refused:
        make(**{field_name: value})
    assert [p.where for p in refused.value.problems] == [field_name]
    assert pickle.loads(pickle.dumps(refused.value)).args == refused.value.args


@pytest.mark.parametrize("window", [0, WINDOW_MAX + 1])
def test_windows_that_would_confuse_numbers_are_refused(window):
    with pytest.raises(BadInput, match="messages on their way"):
        SelectiveRepeat(window)


# A loss of 1 is refused; of 1e5 packets one in ten million runs gets one through.
DEAD = Bernoulli(1.0 - 1e-12)
FINITE = {
    "best_effort": BestEffort(),
    "stop_and_wait": StopAndWait(tries=3),
    "selective_repeat": SelectiveRepeat(2, tries=3),
    "custody": Custody(2, tries=3),
    "tcp": Tcp(give_up_s=100.0),
}


@pytest.mark.parametrize("name", sorted(DELIVERIES))
def test_who_gives_up_some_time_lets_the_clock_end_over_a_dead_link(talk, name):
    s = talk.story(FINITE[name], lose_up=DEAD)
    for _ in range(2):
        s.link.station.send("chat", b"x")
    s.until()
    assert [f.outcome for f in s.fates] == ["gave_up"] * 2
    # 64 skips and a few copies, each with its time-out of 24 s.
    assert s.env.now < 70 * 24.0


@pytest.mark.parametrize("by", [StopAndWait(tries=math.inf), SelectiveRepeat(tries=math.inf), Custody()])
def test_who_never_gives_up_goes_on_for_ever_over_a_dead_link(talk, by):
    s = talk.story(by, lose_up=DEAD)
    s.link.station.send("chat", b"x")
    s.until(1e5)
    assert s.env.peek() < 1e5 + 60.0
    assert [f.outcome for f in s.fates] == ["in_flight"]


def test_a_skip_that_rests_goes_on_with_the_next_message(talk):
    # The message and all its 64 skips are lost, then nothing more.
    s = talk.story(SelectiveRepeat(8, timeout_s=30.0, tries=1), lose_up=talk.These(*range(65)))
    s.link.station.send("chat", b"a")
    s.env.run()
    assert len(s.sent("up")) == 65
    s.link.station.send("chat", b"b")
    s.env.run()
    s.link.close()
    assert s.site.payloads == [b"b"]
    assert [(f.number, f.outcome) for f in s.fates] == [(0, "gave_up"), (1, "delivered")]
    assert len(s.sent("up")) == 67


def test_under_newest_no_acknowledgement_stands_for_another(talk):
    # Three messages arrive within 1.5 s; each acknowledgement takes 3 s and the robot's state 8 s: they wait for each
    # other, and of the states the newest remains.
    down = DirectionSettings(8.0, 10.0, discipline="newest")
    s = talk.story(SelectiveRepeat(timeout_s=1000.0), down=down)
    for name in (b"a", b"b", b"c"):
        s.link.station.send("chat", name)
    s.env.run(until=10.0)
    for i in range(4):
        s.link.site.send("state", bytes([i]) * 7)
    s.until(900.0)
    assert [p.text for p in s.numbered("down") if p.topic == "ack" and p.outcome == "delivered"] == [
        "ack 0",
        "ack 1",
        "ack 2",
    ]
    assert s.sent("up") == [0.0, 0.0, 0.0]
    assert [data[0] for data in s.station.payloads] == [0, 3]
    assert [p.reason for p in s.numbered("down") if p.topic == "state"] == ["", "superseded", "superseded", ""]
