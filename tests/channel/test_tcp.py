"""TCP: closed forms of the handshake and of each loss, bits on the wire, the timer, long delays, connections anew."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.delivery import DELIVERIES, StopAndWait, Tcp
from teleop_sim.channel.link import DirectionSettings
from teleop_sim.channel.loss import Bernoulli
from teleop_sim.channel.tcp_timer import RoundTrips
from teleop_sim.channel.tcp_wire import FIRST_PORT, Segment, is_segment, unpack_segment
from teleop_sim.core.errors import BadInput

# Times stay below 1e5 s, where a double resolves 2e-11 s; a time is a sum of some tens of such numbers.
TOLERANCE_S = 1e-9

UP, DOWN = DirectionSettings(10_000.0, 0.25), DirectionSettings(40_000.0, 0.25)
HEADER_UP_S, HEADER_DOWN_S = 320 / 10_000.0, 320 / 40_000.0
DATA_S = 8 * (40 + 18) / 10_000.0
ROUND_S = HEADER_UP_S + 0.25 + HEADER_DOWN_S + 0.25
"""SYN there, SYN+ACK back: 0.54 s. Rule 2.2 makes 3 * 0.54 = 1.62 s of it, the time-out of the first data."""


def close(value):
    return pytest.approx(value, rel=0, abs=TOLERANCE_S)


def one_command(talk, **losses):
    s = talk.story(Tcp(), UP, DOWN, **losses)
    s.link.station.send("chat", b"x" * 18, "said")
    return s.until(100.0)


def test_the_first_message_arrives_after_a_handshake_and_one_way(talk):
    s = one_command(talk)
    # 1.5 round trips: SYN, SYN+ACK, ACK and data; the ACK's own bits are ahead of the data's.
    arrived_s = ROUND_S + HEADER_UP_S + DATA_S + 0.25
    assert s.got == [(close(arrived_s), b"x" * 18)]
    assert s.news == [(close(arrived_s + HEADER_DOWN_S + 0.25), 0, True)]
    (fate,) = s.fates
    assert (fate.outcome, fate.tries, fate.retransmission_s, fate.order_s) == ("delivered", 1, 0.0, 0.0)
    assert (fate.store_s, fate.link_s) == (close(ROUND_S), close(HEADER_UP_S + DATA_S + 0.25))


def test_the_bits_of_one_command_both_ways(talk):
    s = one_command(talk)
    assert [(p.topic, p.size_bits) for p in s.numbered("up")] == [("syn", 320), ("ack", 320), ("chat", 464)]
    assert [(p.topic, p.size_bits) for p in s.numbered("down")] == [("syn_ack", 320), ("ack", 320)]
    assert (s.link.up.sent_bits, s.link.down.sent_bits) == (1104, 640)


def test_headers_of_the_direction_are_those_of_layers_below_ip(talk):
    s = talk.story(Tcp(), replace(UP, header_bytes=14), replace(DOWN, header_bytes=14))
    s.link.station.send("chat", b"x" * 18)
    s.until(100.0)
    assert (s.link.up.sent_bits, s.link.down.sent_bits) == (1104 + 3 * 112, 640 + 2 * 112)


def test_the_second_message_needs_no_handshake(talk):
    s = one_command_and_another(talk, Tcp())
    assert s.got[1] == (close(50.0 + DATA_S + 0.25), b"y" * 18)
    assert s.link.up.sent_bits == 1104 + 464


def one_command_and_another(talk, by):
    s = talk.story(by, UP, DOWN)
    s.link.station.send("chat", b"x" * 18)
    s.env.run(until=50.0)
    s.link.station.send("chat", b"y" * 18)
    return s.until(100.0)


def test_a_connection_that_was_open_before_the_run_needs_no_handshake_at_all(talk):
    s = one_command_and_another(talk, Tcp(open_at_start=True))
    assert [t_s for t_s, _ in s.got] == [close(DATA_S + 0.25), close(50.0 + DATA_S + 0.25)]
    assert (s.link.up.sent_bits, s.link.down.sent_bits) == (2 * 464, 2 * 320)


def test_a_lost_syn_costs_a_second(talk):
    s = one_command(talk, lose_up=talk.These(0))
    assert s.sent("up", "syn") == [0.0, close(1.0)]
    assert s.got[0][0] == close(1.0 + ROUND_S + HEADER_UP_S + DATA_S + 0.25)
    # The account has it as time before the first copy of the message.
    assert s.fates[0].store_s == close(1.0 + ROUND_S)


def test_a_lost_syn_ack_costs_a_second_and_is_sent_again(talk):
    s = one_command(talk, lose_down=talk.These(0))
    assert len(s.sent("up", "syn")) == len(s.sent("down", "syn_ack")) == 2
    assert s.got[0][0] == close(1.0 + ROUND_S + HEADER_UP_S + DATA_S + 0.25)


def test_a_lost_ack_of_the_handshake_costs_nothing_as_data_follow(talk):
    s = one_command(talk, lose_up=talk.These(1))
    assert s.got[0][0] == close(ROUND_S + HEADER_UP_S + DATA_S + 0.25)
    assert len(s.packets) == 5


def test_lost_data_cost_the_time_out_that_the_handshake_has_measured(talk):
    s = one_command(talk, lose_up=talk.These(2))
    assert s.sent("up", "chat") == [close(ROUND_S), close(ROUND_S + 3 * ROUND_S)]
    assert s.got[0][0] == close(4 * ROUND_S + DATA_S + 0.25)
    (fate,) = s.fates
    assert (fate.tries, fate.retransmission_s, fate.link_s) == (2, close(3 * ROUND_S), close(DATA_S + 0.25))


def test_a_lost_acknowledgement_makes_a_copy_that_the_application_never_sees(talk):
    s = one_command(talk, lose_down=talk.These(1))
    assert s.got == [(close(ROUND_S + HEADER_UP_S + DATA_S + 0.25), b"x" * 18)]
    assert s.sent("up", "chat") == [close(ROUND_S), close(4 * ROUND_S)]
    assert s.news == [(close(4 * ROUND_S + DATA_S + 0.25 + HEADER_DOWN_S + 0.25), 0, True)]
    assert (s.fates[0].tries, s.fates[0].retransmission_s) == (1, 0.0)


def test_after_a_lost_syn_the_time_out_of_data_is_three_seconds(talk):
    # RFC 6298, rule 5.7; and no round trip was measured (Karn).
    s = one_command(talk, lose_up=talk.These(0, 3))
    first_s, again_s = s.sent("up", "chat")
    assert (first_s, again_s - first_s) == (close(1.0 + ROUND_S), close(3.0))


def test_time_outs_double_up_to_a_minute(talk):
    s = one_command(talk, lose_up=talk.These(*range(9)))
    waits = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
    assert s.sent("up", "syn") == [close(sum(waits[:i])) for i in range(7)]
    far = talk.story(Tcp(give_up_s=400.0), UP, DOWN, lose_up=talk.These(*range(99)))
    far.link.station.send("chat", b"x")
    far.until(400.0)
    gaps = [b - a for a, b in zip(far.sent("up", "syn"), far.sent("up", "syn")[1:], strict=False)]
    assert gaps == [close(t) for t in (*waits, 60.0, 60.0, 60.0, 60.0, 60.0)]


def test_twenty_seconds_there_and_back_are_survived_with_spurious_copies(talk):
    # Fast bits: only the delay counts. SYN at 0, 1, 3, 7, 15 s (the next would go at 31 s). Data at 20 s with 3 s (rule
    # 5.7), again at 23 and 29 s; the next would go at 41 s, their acknowledgement comes at 40 s.
    free = DirectionSettings(math.inf, 10.0)
    s = talk.story(Tcp(), free, free)
    s.link.station.send("chat", b"x" * 18)
    s.env.run(until=100.0)
    assert s.got == [(30.0, b"x" * 18)]
    assert s.news == [(40.0, 0, True)]
    assert s.sent("up", "syn") == [0.0, 1.0, 3.0, 7.0, 15.0]
    assert s.sent("up", "chat") == [20.0, 23.0, 29.0]
    # Each SYN is answered, and each answer that comes twice is acknowledged.
    assert len(s.sent("down", "syn_ack")) == 5
    assert s.sent("up", "ack") == [20.0, 21.0, 23.0, 27.0, 35.0]
    # No round trip could be measured yet: 12 s are too short, 24 s are not, and from then on it is known.
    for number, copies in ((1, 2), (2, 1), (3, 1)):
        before = len(s.sent("up", "chat"))
        s.link.station.send("chat", b"y")
        s.env.run(until=100.0 + 100.0 * number)
        assert len(s.sent("up", "chat")) - before == copies
    s.until(500.0)
    # Copies up to the arrival.
    assert [f.tries for f in s.fates] == [3, 1, 1, 1]
    # The counters show what went out in vain: 12 packets with data or SYN for 4 messages and one handshake.
    counts = s.link.up.counters.by_topic
    assert (counts["syn"].offered, counts["chat"].offered, counts["ack"].offered) == (5, 7, 5)


def test_the_slowest_link_of_the_challenge_is_survived(talk):
    s = talk.story(Tcp())
    for i in range(5):
        s.link.station.send("chat", bytes([i]) * 18)
    s.until(3000.0)
    assert s.site.payloads == [bytes([i]) * 18 for i in range(5)]
    assert all(ok for _, _, ok in s.news)


def test_long_messages_go_in_segments_of_the_mtu_and_come_back_whole(talk):
    s = talk.story(Tcp(), replace(UP, rate_bps=50_000.0), DOWN)
    data = bytes(range(256)) * 20
    s.link.station.send("image", data)
    s.until(100.0)
    sizes = [p.payload_bytes for p in s.numbered("up") if p.topic == "image"]
    assert sizes == [1500, 1500, 1500, 40 + 5120 - 3 * 1460]
    # 80 bytes of SYN and ACK before the data, at 50 kbit/s.
    assert s.got == [(close(0.25 + HEADER_DOWN_S + 0.25 + 8 * (80 + sum(sizes)) / 50_000.0 + 0.25), data)]
    assert s.link.down.counters.by_topic["ack"].offered == 4


def test_the_mtu_of_the_direction_counts_if_it_is_smaller(talk):
    s = talk.story(Tcp(), replace(UP, header_bytes=14, mtu_bytes=154), DOWN)
    s.link.station.send("image", b"x" * 250)
    s.until(100.0)
    assert [p.size_bits for p in s.numbered("up") if p.topic == "image"] == [8 * 154, 8 * 154, 8 * (54 + 50)]


def test_a_window_of_segments_a_round_trip(talk):
    # Free bits: a window leaves at once, and its acknowledgements come a round trip later.
    free = DirectionSettings(math.inf, 0.25)
    s = talk.story(Tcp(window=3, mtu_bytes=41), free, free)
    s.link.station.send("chat", b"12345678")
    s.until(100.0)
    assert s.sent("up", "chat") == [close(t) for t in (0.5, 0.5, 0.5, 1.0, 1.0, 1.0, 1.5, 1.5)]
    assert s.got == [(close(1.75), b"12345678")]
    # The last part waited for its place in the window, which is no retransmission.
    assert (s.fates[0].store_s, s.fates[0].retransmission_s, s.fates[0].link_s) == (close(1.5), 0.0, close(0.25))


def test_what_comes_behind_a_hole_waits_and_one_segment_is_repeated(talk):
    # Up: SYN, ACK, a, b, c; b is lost. The time-out runs from the acknowledgement of a: 1.62 s and the sample of a.
    s = talk.story(Tcp(), UP, DOWN, lose_up=talk.These(3))
    for name in (b"a", b"b", b"c"):
        s.link.station.send("chat", name * 18)
    s.until(100.0)
    assert s.site.payloads == [b"a" * 18, b"b" * 18, b"c" * 18]
    assert len(s.sent("up", "chat")) == 4
    a, b, c = s.fates
    assert (a.order_s, b.order_s, a.tries, b.tries, c.tries) == (0.0, 0.0, 1, 2, 1)
    heard_s = ROUND_S + HEADER_UP_S + DATA_S + 0.25 + HEADER_DOWN_S + 0.25
    timer = RoundTrips().measured(ROUND_S).measured(heard_s - ROUND_S)
    assert s.sent("up", "chat")[3] == close(heard_s + timer.rto_s)
    assert b.ended_s == c.ended_s == close(heard_s + timer.rto_s + DATA_S + 0.25)
    assert [p.text for p in s.numbered("down")] == ["syn_ack 1", "ack 19", "ack 19", "ack 55"]


def test_a_dead_link_is_given_up_at_the_given_time_and_the_clock_ends(talk):
    s = talk.story(Tcp(give_up_s=100.0), UP, DOWN, lose_up=talk.These(*range(1000)))
    s.link.station.send("chat", b"x")
    s.link.station.send("chat", b"y")
    s.until()
    assert s.news == [(100.0, 0, False), (100.0, 1, False)]
    assert [(f.outcome, f.reason, f.ended_s, f.tries) for f in s.fates] == [("gave_up", "no_connection", 100.0, 0)] * 2
    # The alarm that the end made needless is the last event: RFC 6298 waits a minute at most.
    assert s.env.now <= 160.0


def test_after_giving_up_the_next_message_opens_a_new_connection(talk):
    # Dark from 2 s to 300 s: of the second message nothing gets through; its copies wait, and come late, once.
    up = replace(UP, blackouts=((2.0, 300.0),))
    s = talk.story(Tcp(give_up_s=100.0), up, DOWN)
    s.link.station.send("chat", b"x")
    s.env.run(until=3.0)
    s.link.station.send("chat", b"y")
    s.env.run(until=290.0)
    assert [(t_s, ok) for t_s, _, ok in s.news][1:] == [(103.0, False)]
    s.link.station.send("chat", b"z")
    s.until(1000.0)
    assert s.site.payloads == [b"x", b"y", b"z"]
    assert [f.outcome for f in s.fates] == ["delivered"] * 3
    assert len(s.sent("up", "syn")) > 1


def test_of_an_earlier_connection_nothing_is_taken_any_more(talk):
    # The window takes two messages; the first is lost for good and the connection given up: what stood behind it was
    # held, and goes when the next connection opens.
    s = talk.story(Tcp(give_up_s=1.0), UP, DOWN, lose_up=talk.These(2))
    s.link.station.send("chat", b"a")
    s.link.station.send("chat", b"b")
    s.env.run(until=50.0)
    assert [ok for _, _, ok in s.news] == [False, False]
    s.link.station.send("chat", b"c")
    s.until(100.0)
    assert s.site.payloads == [b"c"]
    assert sorted((f.number, f.outcome) for f in s.fates) == [(0, "gave_up"), (1, "gave_up"), (2, "delivered")]


def test_both_sites_may_send_by_tcp_each_in_a_connection_of_its_own(talk):
    s = talk.story(Tcp(), UP, DOWN, back=Tcp())
    s.link.station.send("chat", b"up")
    s.link.site.send("log", b"down")
    s.until(100.0)
    assert (s.site.payloads, s.station.payloads) == ([b"up"], [b"down"])
    assert s.link.up.counters.by_topic["syn"].offered == s.link.down.counters.by_topic["syn"].offered == 1


def test_tcp_one_way_and_frames_the_other_do_not_disturb_each_other(talk):
    s = talk.story(Tcp(), UP, DOWN, back=StopAndWait())
    s.link.station.send("chat", b"up")
    s.link.site.send("log", b"down")
    s.until(100.0)
    assert (s.site.payloads, s.station.payloads) == ([b"up"], [b"down"])


def test_a_message_without_bytes_is_refused(talk):
    s = talk.story(Tcp())
    with pytest.raises(BadMessage, match="carries bytes only"):
        s.link.station.send("chat", b"")
    assert s.link.station.book.offered == 0


@pytest.mark.parametrize(
    ("field_name", "value"),
    [("window", 0), ("give_up_s", 0.0), ("give_up_s", math.nan), ("mtu_bytes", 40), ("mtu_bytes", 65536)],
)
def test_connections_that_cannot_work_are_refused(field_name, value):
    with pytest.raises(BadInput) as refused:
        Tcp(**{field_name: value})
    assert [p.where for p in refused.value.problems] == [field_name]
    assert pickle.loads(pickle.dumps(refused.value)).args == refused.value.args


def test_directions_with_too_short_fragments_are_refused(talk):
    with pytest.raises(BadInput, match=r"fragments of 40 bytes[\s\S]*fragments of 39 bytes") as refused:
        talk.story(Tcp(), replace(UP, mtu_bytes=40), replace(DOWN, mtu_bytes=39))
    assert [p.hint for p in refused.value.problems] == ["Give 41 or more, or 0.", "Give 40 or more, or 0."]


@pytest.mark.parametrize("way", ["up", "down"])
def test_a_direction_that_charges_tcp_s_headers_already_is_refused(talk, way):
    ways = {"up": UP, "down": DOWN}
    ways[way] = replace(ways[way], header_bytes=40)
    with pytest.raises(BadInput, match="header_bytes: 40 bytes and TCP's and IP's own 40"):
        talk.story(Tcp(), **ways)
    # Ethernet's 14 and 24 of a tunnel are below IP.
    ways[way] = replace(ways[way], header_bytes=38)
    talk.story(Tcp(), **ways)


def test_a_connection_that_was_open_and_fails_is_no_missing_connection(talk):
    s = talk.story(Tcp(give_up_s=100.0, open_at_start=True), UP, DOWN, lose_up=talk.These(*range(1000)))
    s.link.station.send("chat", b"x")
    s.until()
    assert [(f.outcome, f.reason) for f in s.fates] == [("gave_up", "gave_up")]


def test_the_timer_is_that_of_the_standard():
    # RFC 6298, rules 2.1 to 2.5 with their constants 1/8, 1/4 and 4, by hand.
    trips = RoundTrips()
    assert trips.rto_s == 1.0
    trips = trips.measured(20.0)
    assert (trips.smoothed_s, trips.spread_s, trips.rto_s) == (20.0, 10.0, 60.0)
    trips = trips.measured(12.0)
    assert (trips.smoothed_s, trips.spread_s, trips.rto_s) == (19.0, 9.5, 57.0)
    assert trips.backed_off().rto_s == 60.0
    assert RoundTrips().measured(0.1).rto_s == 1.0
    assert RoundTrips().backed_off().backed_off().rto_s == 4.0
    assert RoundTrips(rto_s=16.0).after_syn_lost().rto_s == 3.0


@given(st.lists(st.floats(0.0, 100.0), min_size=1))
def test_the_time_out_is_always_from_a_second_to_a_minute(rounds_s):
    trips = RoundTrips()
    for round_s in rounds_s:
        trips = trips.measured(round_s)
        assert 1.0 <= trips.rto_s <= 60.0
        assert min(rounds_s) <= trips.smoothed_s * (1 + 1e-12)
        assert trips.smoothed_s <= max(rounds_s) * (1 + 1e-12)


sequence_numbers = st.integers(0, 2**32 - 1)
segments = st.builds(
    Segment,
    st.integers(FIRST_PORT, 65535),
    st.booleans(),
    sequence_numbers,
    st.one_of(st.none(), sequence_numbers),
    syn=st.booleans(),
    push=st.booleans(),
    window_bytes=st.integers(0, 65535),
    data=st.binary(max_size=100),
)


@given(segments)
def test_segments_come_back_from_their_bytes(segment):
    data = segment.pack()
    assert unpack_segment(data) == segment
    assert len(data) == 40 + len(segment.data)
    assert is_segment(data)


def test_a_segment_is_laid_out_as_the_standards_say():
    data = Segment(0xC000, True, 0x01020304, 0x05060708, push=True, window_bytes=0xFFFF, data=b"hi").pack()
    assert data[:20].hex() == "4500002a" + "00004000" + "40060000" + "00000000" + "00000000"
    assert data[20:].hex() == "c0001388" + "01020304" + "05060708" + "5018ffff" + "00000000" + b"hi".hex()


@pytest.mark.parametrize("data", [b"", b"\x45", b"\x45" + bytes(50), b"\x01" * 40])
def test_bytes_that_are_no_segment_are_refused(data):
    with pytest.raises(BadMessage, match="same deliveries"):
        unpack_segment(data)


def test_sequence_numbers_wrap(talk):
    # The connection starts just below the wrap, as after four billion bytes.
    s = talk.story(Tcp(open_at_start=True), DirectionSettings(math.inf, 0.25), DOWN, Bernoulli(0.2), Bernoulli(0.2))
    begin = 2**32 - 50
    s.link.station._sender._oldest = s.link.station._sender._next = begin
    s.link.site._listener._expected = begin
    messages = [bytes([i]) * 18 for i in range(20)]
    for message in messages:
        s.link.station.send("chat", message)
    s.until()
    assert s.site.payloads == messages
    assert [n for _, n, ok in s.news if ok] == list(range(20))


def test_the_registry_has_it():
    assert DELIVERIES["tcp"] is Tcp


@pytest.mark.parametrize(("give_up_s", "outcome"), [(924.6, "gave_up"), (math.inf, "delivered")])
def test_a_handshake_over_mars_takes_more_patience_than_usual(talk, give_up_s, outcome):
    # 12.5 minutes each way: the answer to the SYN comes after 1500 s.
    mars = DirectionSettings(math.inf, 750.0)
    s = talk.story(Tcp(give_up_s=give_up_s), mars, mars)
    s.link.station.send("chat", b"x")
    s.until()
    assert [(f.outcome, f.reason) for f in s.fates] == [(outcome, "no_connection" if outcome == "gave_up" else "")]
