"""Messages through a link: rows in closed form, their CSV, and lists of messages that are wrong."""

import contextlib
import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim.channel.feasible import light_windows, undeliverable
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.channel.trace import HEADER, Offer, read_offers, trace, trace_csv
from teleop_sim.channel.trace_picture import draw_trace
from teleop_sim.core.errors import BadInput

WAITS = ("queue_s", "serialisation_s", "blackout_s", "propagation_s", "retransmission_s")


OFFERS = st.builds(Offer, st.floats(0, 50), st.sampled_from("ab"), st.integers(0, 60), st.integers(0, 2))


def traced(offers, link, seed=0, **more):
    return trace(offers, link, np.random.default_rng(seed), **more)


def places(text):
    with pytest.raises(BadInput) as refused:
        read_offers(text, "m.csv")
    return [p.where for p in refused.value.problems]


def test_an_idle_link_delivers_after_bits_over_rate_and_delay():
    [row] = traced([Offer(3.0, "walk", 18)], DirectionSettings(64.0, 10.0))
    # 8 * 18 / 64 + 10 = 12.25 s.
    assert (row.id, row.topic, row.bytes, row.sent_s, row.outcome, row.reason) == (0, "walk", 18, 3.0, "delivered", "")
    assert row.arrived_s == pytest.approx(15.25, abs=1e-9)
    waits = (row.serialisation_s, row.propagation_s, row.queue_s, row.blackout_s, row.retransmission_s)
    assert waits == pytest.approx((2.25, 10.0, 0.0, 0.0, 0.0), abs=1e-9)


def test_rows_come_in_order_of_time_whatever_the_order_of_the_list():
    rows = traced([Offer(5.0, "b", 1), Offer(0.0, "a", 1), Offer(5.0, "c", 1)], DirectionSettings(8.0, 1.0))
    assert [(row.id, row.topic) for row in rows] == [(0, "a"), (1, "b"), (2, "c")]
    assert [row.arrived_s for row in rows] == pytest.approx([2.0, 7.0, 8.0], abs=1e-9)


def test_what_does_not_arrive_has_no_arrival():
    dark = DirectionSettings(8.0, 0.0, blackouts=((2.0, math.inf),))
    first, second = traced([Offer(0.0, "a", 1), Offer(1.0, "b", 5)], dark)
    assert first.arrived_s == 1.0
    assert (second.arrived_s, second.outcome) == (None, "in_flight")
    cut = traced([Offer(0.0, "a", 1), Offer(9.0, "late", 1)], DirectionSettings(8.0, 0.0), until_s=5.0)
    assert [row.topic for row in cut] == ["a"]


@settings(max_examples=60, deadline=None)
@given(
    st.lists(OFFERS, max_size=12),
    st.floats(10.0, 1e4),
    st.floats(0.0, 20.0),
    st.sampled_from(["fifo", "priority", "newest"]),
    st.integers(0, 3),
    st.sampled_from([0, 20]),
)
def test_every_message_has_a_row_and_its_waits_add_up(offers, rate_bps, delay_s, discipline, limit, mtu):
    link = DirectionSettings(
        rate_bps, delay_s, 4, ((5.0, 9.0), (20.0, 30.0)), discipline=discipline, queue_limit=limit, mtu_bytes=mtu
    )
    rows = traced(offers, link)
    assert [row.id for row in rows] == list(range(len(offers)))
    assert sorted(row.bytes for row in rows) == sorted(offer.bytes for offer in offers)
    for row in rows:
        assert (row.outcome == "delivered") == (row.arrived_s is not None)
        assert (row.outcome == "dropped") == bool(row.reason)
        if row.arrived_s is not None:
            total_s = sum(getattr(row, name) for name in WAITS)
            # Sums of times below 1e4 s in double precision.
            assert total_s == pytest.approx(row.arrived_s - row.sent_s, abs=1e-8)


def test_the_same_seed_gives_the_same_rows():
    from teleop_sim.channel.loss import Bernoulli

    link = DirectionSettings(1e3, 1.0, loss=Bernoulli(0.3))
    offers = [Offer(float(t), "a", 10) for t in range(50)]
    assert traced(offers, link, 1) == traced(offers, link, 1)
    assert {row.outcome for row in traced(offers, link, 1)} == {"delivered", "dropped"}
    assert traced(offers, link, 1) != traced(offers, link, 2)


@pytest.mark.parametrize(
    ("link", "reason"),
    [
        (DirectionSettings(8.0, 0.0, 4, budget_bits=39), "one header and one byte"),
        (DirectionSettings(8.0, 0.0, blackouts=((0.0, math.inf),)), "dark all the time"),
        (DirectionSettings(8.0, 0.0, 4, ((4.0, math.inf),), on_dark="lose"), "longest light, 4 s, carries 32 bits"),
        (DirectionSettings(8.0, 0.0, 4, ((4.0, math.inf),), on_dark="restart"), "one fragment has 40"),
        (DirectionSettings(8.0, 0.0, 4, ((4.0, math.inf),)), "longest light"),
    ],
)
def test_a_link_that_delivers_nothing_is_refused_with_the_reason(link, reason):
    with pytest.raises(BadInput, match=reason):
        traced([Offer(0.0, "a", 1)], link)


def test_short_light_will_do_where_a_fragment_pauses():
    flicker = ((4.0, 5.0), (9.0, math.inf))
    assert undeliverable(DirectionSettings(8.0, 0.0, 4, flicker), math.inf, "up") == ()
    assert undeliverable(DirectionSettings(8.0, 0.0, 4, flicker, on_dark="lose"), math.inf, "up") != ()
    assert light_windows(flicker, math.inf) == ((0.0, 4.0), (5.0, 9.0))
    assert light_windows(flicker, 7.0) == ((0.0, 4.0), (5.0, 7.0))
    assert light_windows((), 7.0) == ((0.0, 7.0),)


def test_csv_has_the_columns_and_plain_numbers():
    rows = traced([Offer(0.1, "a,b", 18), Offer(0.3, "c", 1)], DirectionSettings(64.0, 10.0), until_s=11.0)
    text = trace_csv(rows)
    assert text.splitlines()[0] == (
        "id,topic,bytes,sent_s,arrived_s,outcome,reason,"
        "queue_s,serialisation_s,blackout_s,propagation_s,retransmission_s"
    )
    first, second = csv.DictReader(io.StringIO(text))
    assert tuple(first) == HEADER
    assert (first["topic"], first["sent_s"], first["queue_s"], first["arrived_s"]) == ("a,b", "0.1", "0", "")
    assert second["outcome"] == "in_flight"


def test_messages_are_read_in_any_order_of_columns_and_without_priority():
    assert read_offers("bytes,time,topic\n3,0.5,a\n\n 4 ,1,b\n", "m") == (Offer(0.5, "a", 3), Offer(1.0, "b", 4))
    assert read_offers("time,topic,bytes,priority\n0,a,3,7\n0,a,3,\n", "m") == (Offer(0, "a", 3, 7), Offer(0, "a", 3))
    assert read_offers('time,topic,bytes\r\n0,"a,b",1\r\n', "m") == (Offer(0.0, "a,b", 1),)
    assert read_offers("time,topic,bytes\n", "m") == ()


def test_all_problems_of_a_list_are_told_at_once_with_their_place():
    text = "time,topic,bytes,priority\n-1,a,1,0\n0,,x,0.5\nnan,b,-1,0\n0,a,1,0,9\n"
    assert places(text) == [
        "m.csv:2: time",
        "m.csv:3: bytes",
        "m.csv:3: priority",
        "m.csv:3: topic",
        "m.csv:4: time",
        "m.csv:4: bytes",
        "m.csv:5",
    ]


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("", ["m.csv:1"]),
        ("\n\n", ["m.csv:1"]),
        ("time,topic\n0,a\n", ["m.csv:1: bytes"]),
        ("time,topic,byte\n0,a,1\n", ["m.csv:1", "m.csv:1: bytes"]),
        ("time,topic,bytes,bytes\n", ["m.csv:1: bytes"]),
        ('time,topic,bytes\n0,"a,1\n', ["m.csv:2"]),
        ("time,topic,bytes\n0,a\n", ["m.csv:2: bytes"]),
        ("time,topic,bytes\n0,a,2000000000\n", ["m.csv:2: bytes"]),
    ],
)
def test_a_list_that_cannot_be_read_is_refused(text, where):
    assert places(text) == where


@given(st.text(max_size=80))
def test_any_text_is_a_list_or_bad_input(text):
    for given_text in (text, f"time,topic,bytes\n{text}"):
        with contextlib.suppress(BadInput):
            read_offers(given_text, "m.csv")


@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_a_picture_is_the_same_for_the_same_rows(tmp_path, suffix):
    rows = traced([Offer(float(i), "a$b", 40) for i in range(6)], DirectionSettings(64.0, 10.0), until_s=25.0)
    draw_trace(rows, tmp_path / f"a.{suffix}", "$ title")
    draw_trace(rows, tmp_path / f"b.{suffix}", "$ title")
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_a_picture_of_nothing_and_of_many(tmp_path):
    draw_trace((), tmp_path / "none.png", "none")
    many = traced([Offer(float(i), "a", 4) for i in range(300)], DirectionSettings(64.0, 10.0))
    draw_trace(many, tmp_path / "many.png", "many")
    with pytest.raises(ValueError, match="svg"):
        draw_trace((), tmp_path / "none.gif", "")
