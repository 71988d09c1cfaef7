"""TCP repeats before its timer: closed forms of fast retransmission and partial acknowledgements, and what it costs."""

from __future__ import annotations

import math
import statistics
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.delivery import Tcp
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.channel.tcp_recovery import DUPLICATES, Recovery

# Times stay below 1e5 s, where a double resolves 2e-11 s; a time is a sum of some tens of such numbers.
TOLERANCE_S = 1e-9

UP, DOWN = DirectionSettings(10_000.0, 0.25), DirectionSettings(40_000.0, 0.25)
BYTES = 18
DATA_S = 8 * (40 + BYTES) / 10_000.0
BACK_S = 0.25 + 320 / 40_000.0 + 0.25
"""From the last bit of a segment to the last of its acknowledgement: 0.508 s."""
FIRST_S = 1.0
"""The time-out before anything was measured (RFC 6298, rule 2.1)."""


def close(value):
    return pytest.approx(value, rel=0, abs=TOLERANCE_S)


def messages(number):
    return [bytes([i]) * BYTES for i in range(number)]


def burst(talk, number, by=None, up=UP, down=DOWN, **losses):
    """So many commands at once over a connection that is open, so that the first packets up are their segments."""
    s = talk.story(by or Tcp(open_at_start=True), up, down, **losses)
    for message in messages(number):
        s.link.station.send("chat", message)
    return s.until(400.0)


def test_three_duplicates_repeat_the_oldest_before_the_timer(talk):
    s = burst(talk, 5, lose_up=talk.These(0))
    # The fourth segment makes the third duplicate.
    third_s = 4 * DATA_S + BACK_S
    assert third_s < FIRST_S
    assert s.sent("up", "chat") == [0.0] * 5 + [close(third_s)]
    assert s.got == [(close(third_s + DATA_S + 0.25), message) for message in messages(5)]
    assert [(f.tries, f.retransmission_s) for f in s.fates] == [(2, close(third_s))] + [(1, 0.0)] * 4
    # The price: each segment and each of its acknowledgements is a packet of 40 bytes and what it carries.
    assert [p.text for p in s.numbered("down")] == ["ack 1"] * 4 + [f"ack {1 + 5 * BYTES}"]
    assert (s.link.up.sent_bits, s.link.down.sent_bits) == (6 * 8 * (40 + BYTES), 5 * 320)


def test_the_timer_begins_anew_with_the_repetition(talk):
    # Without that it would run out, at 1 s, before the answer to the repetition can come: at 1.25 s.
    s = burst(talk, 5, lose_up=talk.These(0))
    assert 4 * DATA_S + BACK_S < FIRST_S < 5 * DATA_S + 2 * BACK_S
    assert len(s.sent("up", "chat")) == 6
    # And if the repetition is lost too, it runs out a time-out after that.
    s = burst(talk, 5, lose_up=talk.These(0, 5))
    assert s.sent("up", "chat")[5:] == [close(4 * DATA_S + BACK_S), close(4 * DATA_S + BACK_S + FIRST_S)]


def test_of_a_repetition_no_round_trip_is_measured(talk):
    # The first of the burst was timed and repeated (Karn): the time-out of a later message is still the first.
    s = talk.story(Tcp(open_at_start=True), UP, DOWN, lose_up=talk.These(0, 6))
    for message in messages(5):
        s.link.station.send("chat", message)
    s.env.run(until=50.0)
    s.link.station.send("chat", b"later")
    s.until(100.0)
    assert s.sent("up", "chat")[6:] == [50.0, close(50.0 + FIRST_S)]


def test_two_duplicates_may_be_disorder_and_wait_for_the_timer(talk):
    s = burst(talk, 3, lose_up=talk.These(0))
    assert s.sent("up", "chat") == [0.0] * 3 + [FIRST_S]
    assert s.site.payloads == messages(3)


def test_duplicates_that_are_lost_do_not_count(talk):
    s = burst(talk, 5, lose_up=talk.These(0), lose_down=talk.These(1))
    assert s.sent("up", "chat")[5] == close(5 * DATA_S + BACK_S)


def test_a_second_hole_is_repeated_when_the_first_is_filled(talk):
    # a and c are lost; b, d and e make three duplicates; the answer to a asks for c (RFC 6582).
    s = burst(talk, 7, lose_up=talk.These(0, 2))
    first_s = 5 * DATA_S + BACK_S
    assert s.sent("up", "chat")[7:] == [close(first_s), close(first_s + DATA_S + BACK_S)]
    assert s.got[-1] == (close(first_s + 2 * DATA_S + BACK_S + 0.25), messages(7)[6])
    assert s.site.payloads == messages(7)
    assert [f.tries for f in s.fates] == [2, 1, 2, 1, 1, 1, 1]


def test_holes_are_filled_one_a_round_trip(talk):
    # Every other one of the first ten is lost; the timer never runs out.
    holes = (0, 2, 4, 6, 8)
    s = burst(talk, 12, lose_up=talk.These(*holes))
    # b, d and f: the third duplicate.
    first_s = 6 * DATA_S + BACK_S
    gaps_s = [first_s + i * (DATA_S + BACK_S) for i in range(len(holes))]
    assert s.sent("up", "chat")[12:] == [close(t_s) for t_s in gaps_s]
    assert s.site.payloads == messages(12)


def test_after_a_time_out_the_second_hole_does_not_wait_for_another(talk):
    s = burst(talk, 3, lose_up=talk.These(0, 1))
    assert s.sent("up", "chat")[3:] == [FIRST_S, close(FIRST_S + DATA_S + BACK_S)]
    assert s.site.payloads == messages(3)


def test_new_data_go_on_while_a_hole_is_filled(talk):
    # The window is fixed: what is lost closes nothing. Seven take the window, the eighth waits for the first.
    s = burst(talk, 8, Tcp(window=7, open_at_start=True), lose_up=talk.These(0))
    third_s = 4 * DATA_S + BACK_S
    assert s.sent("up", "chat") == [0.0] * 7 + [close(third_s), close(third_s + DATA_S + BACK_S)]


def test_a_time_out_that_was_too_early_repeats_all_that_was_on_its_way_and_the_counters_show_it(talk):
    # Fast bits, 10 s each way: the first goes at 0, 1, 3, 7 and 15 s. The answers to all five come at 20 s; each but
    # the last looks like that of a hole.
    free = DirectionSettings(math.inf, 10.0)
    s = burst(talk, 5, up=free, down=free)
    assert s.sent("up", "chat") == [0.0] * 5 + [1.0, 3.0, 7.0, 15.0] + [20.0] * 4
    assert s.got == [(10.0, message) for message in messages(5)]
    assert s.link.up.counters.by_topic["chat"].offered == 13
    # Every copy is answered, by a duplicate, of which nothing is concluded.
    assert s.link.down.counters.by_topic["ack"].offered == 13
    # Copies up to the arrival.
    assert [f.tries for f in s.fates] == [4, 1, 1, 1, 1]


def test_both_numbers_of_a_hole_at_the_wrap(talk):
    s = talk.story(Tcp(open_at_start=True), UP, DOWN, lose_up=talk.These(0, 2))
    begin = 2**32 - 30
    s.link.station._sender._oldest = s.link.station._sender._next = begin
    s.link.site._listener._expected = begin
    for message in messages(7):
        s.link.station.send("chat", message)
    s.until(100.0)
    first_s = 5 * DATA_S + BACK_S
    assert s.sent("up", "chat")[7:] == [close(first_s), close(first_s + DATA_S + BACK_S)]
    assert s.site.payloads == messages(7)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.just("up"), st.integers(0, 90)), min_size=1, max_size=30))
def test_where_nothing_is_lost_and_a_round_trip_is_below_the_time_out_nothing_is_repeated(talk, pattern):
    t_s, sends = 0.0, []
    for gap_s, name, size in pattern:
        t_s += gap_s
        sends.append((t_s, name, size))
    # 30 messages of 132 bytes at 100 kbit/s keep each other waiting 0.33 s at most.
    ways = replace(UP, rate_bps=1e5), replace(DOWN, rate_bps=1e5)
    run = talk.converse(ways, (Tcp(), talk.BestEffort()), sends, 1e4, 1)
    assert len(run.sent("up", "chat")) == len(sends)
    assert len(run.sent("down", "ack")) == len(sends)


@settings(max_examples=100, deadline=None)
@given(st.integers(5, 43), st.data())
def test_one_loss_among_many_costs_three_segments_and_a_round_trip(talk, number, data):
    lost = data.draw(st.integers(0, number - 1 - DUPLICATES))
    s = burst(talk, number, up=replace(UP, rate_bps=1e6), lose_up=talk.These(lost))
    data_s = 8 * (40 + BYTES) / 1e6
    # Acknowledgements go out more slowly than segments come in and stand in line, from the first segment that arrives.
    first_s = (2 if lost == 0 else 1) * data_s
    third_s = first_s + 0.25 + (lost + DUPLICATES) * 320 / 40_000.0 + 0.25
    assert s.sent("up", "chat")[number:] == [close(third_s)]
    assert s.site.payloads == messages(number)
    assert s.fates[lost].retransmission_s == close(third_s)


@pytest.mark.parametrize(("delay_s", "mean_s"), [(0.5, 8.0), (10.0, 85.4)])
def test_heartbeats_over_a_link_that_loses_a_fifth_each_way_come_as_the_page_says(talk, delay_s, mean_s):
    way, waits_s = DirectionSettings(50e3, delay_s, loss=Bernoulli(0.2)), []
    sends = [(10.0 * i, "up", 18) for i in range(100)]
    for seed in range(20):
        run = talk.converse((way, way), (Tcp(), talk.BestEffort()), sends, 2e4, seed)
        waits_s += [f.ended_s - f.offered_s for f in run.fates if f.outcome == "delivered"]
    assert len(waits_s) == 20 * len(sends)
    # The draws are fixed; the page rounds.
    assert statistics.fmean(waits_s) == pytest.approx(mean_s, abs=0.5)


# The value

acknowledgements = st.lists(st.one_of(st.just("same"), st.integers(1, 5), st.just("time-out")), max_size=60)


@given(acknowledgements)
def test_one_repetition_a_number_and_never_two_for_the_same_news(steps):
    """Between time-outs nothing is repeated twice: a number is repeated for its duplicates or as it comes, once."""
    now, oldest, following, repeated = Recovery(), 1, 100, []
    for step in steps:
        if step == "same":
            now, again = now.duplicate(oldest, following)
        elif step == "time-out":
            now, again, repeated = now.timed_out(following), False, [oldest]
        else:
            oldest = min(following, oldest + step)
            following += 3
            now, again = now.advanced(oldest)
        if again:
            assert oldest not in repeated
            repeated.append(oldest)
        assert now.until <= following
        assert not now.under_way or oldest < now.until


def test_duplicates_of_what_was_taken_for_lost_begin_nothing():
    # RFC 6582, section 3.2, step 2: more than ``recover`` must be acknowledged, for copies have duplicates too.
    now = Recovery().timed_out(100)
    for oldest, begins in ((100, False), (101, True)):
        later, partial = now.advanced(oldest)
        assert (later.under_way, partial) == (False, False)
        for _ in range(DUPLICATES - 1):
            later, again = later.duplicate(oldest, 200)
            assert not again
        later, again = later.duplicate(oldest, 200)
        assert again == begins
        assert (later.until, later.under_way) == ((200, True) if begins else (100, False))
