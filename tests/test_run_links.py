"""Whole runs over links that lose, repeat, go dark and change: what the log then says. Costs about eight runs."""

import math
from collections import Counter
from functools import cache
from itertools import pairwise

import pytest

from teleop_sim import load_scenario
from teleop_sim.channel.delivery import DELIVERIES
from teleop_sim.core.errors import BadInput
from teleop_sim.core.records import MessageEnded, ModeChanged, PacketEnded, Released, Requested, TransitionTaken
from teleop_sim.log.load import load
from teleop_sim.reports.ledger import ALL, message_ledger
from teleop_sim.run import RunResult, run_scenario
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.links import link_problems

SEED = 12
"""A world that takes two turns of a handle: cheap runs."""

DELAY_S, UP_BPS, HEADER_BYTES = 0.5, 4000.0, 40
NEAR = {
    "autonomy": "off",
    "pacing": "eager",
    "link.up.rate_bps": UP_BPS,
    "link.up.delay_s": DELAY_S,
    "link.down.delay_s": DELAY_S,
}
LOSSY = {f"link.{way}.loss": {"model": "bernoulli", "p": 0.2} for way in ("up", "down")}
REPEATING = sorted(set(DELIVERIES) - {"best_effort"})


@pytest.fixture(scope="module")
def go(tmp_path_factory):
    """Run src-dish near by with overrides, once for each label."""
    folder = tmp_path_factory.mktemp("links")

    @cache
    def once(label: str) -> RunResult:
        return run_scenario(load_scenario("src-dish", NEAR | wanted[label]), SEED, folder / label)

    wanted: dict[str, dict[str, object]] = {}

    def call(label: str, **overrides: object) -> RunResult:
        wanted[label] = {key.replace("__", "."): value for key, value in overrides.items()}
        return once(label)

    return call


def lossy(go, delivery: str) -> RunResult:
    # TCP's packets bring their 40 bytes of headers with them.
    more = {"link.up.header_bytes": 0, "link.down.header_bytes": 0} if delivery == "tcp" else {}
    changes = {key.replace(".", "__"): value for key, value in (LOSSY | more).items()}
    return go(f"lossy-{delivery}", link__delivery=delivery, **changes)


def records(result: RunResult, kind: type):
    return [r for r in load(result.log).records() if isinstance(r, kind)]


def round_trips_s(result: RunResult) -> list[float]:
    """From each request to its answer, as the field site knows it."""
    asked_s = {r.request: r.t_s for r in records(result, Requested)}
    return [r.t_s - asked_s[r.request] for r in records(result, Released) if r.effect == "answered"]


@pytest.mark.parametrize("delivery", REPEATING)
def test_what_a_link_loses_a_delivery_brings_across_and_only_the_round_trips_take_longer(go, delivery):
    """T = T0 + the round trips: as over a link that loses nothing, apart from what each trip takes."""
    clean, repaired = go("clean"), lossy(go, delivery)
    assert clean.outcome == repaired.outcome == "completed", repaired.cause
    trips, longer = round_trips_s(clean), round_trips_s(repaired)
    assert len(longer) == len(trips) == repaired.round_trips >= 14
    rest_s = repaired.completion_time_s - math.fsum(longer)
    assert rest_s == pytest.approx(clean.completion_time_s - math.fsum(trips), abs=1e-6)
    # No answer comes sooner than its bits: a header and at least a byte, there and back.
    assert min(longer) > 2 * DELAY_S + 8 * (HEADER_BYTES + 1) / UP_BPS


@pytest.mark.parametrize("delivery", REPEATING)
def test_every_copy_is_a_packet_with_one_end_and_its_full_price(go, delivery):
    result = lossy(go, delivery)
    requests, answers = len(records(result, Requested)), result.operator_acts
    for way, topic, messages in (("down", "request", requests), ("up", "confirm", answers)):
        packets = [p for p in records(result, PacketEnded) if p.direction == way]
        assert sorted(p.packet for p in packets) == list(range(len(packets)))
        fates = Counter(p.outcome for p in packets)
        assert fates["delivered"] + fates["dropped"] + fates["in_flight"] == len(packets)
        assert {p.reason for p in packets if p.outcome == "dropped"} == {"lost"}
        header_bytes = 0 if delivery == "tcp" else HEADER_BYTES
        assert {p.size_bits - 8 * p.payload_bytes for p in packets} == {8 * header_bytes}
        assert min(p.size_bits for p in packets) >= 8 * HEADER_BYTES
        copies = sum(p.topic == topic for p in packets)
        assert copies >= messages
        # 0.2 of some hundred packets, seven standard deviations wide.
        assert 0 < fates["dropped"] < 0.6 * len(packets)


@pytest.mark.parametrize("delivery", REPEATING)
def test_every_message_has_one_fate_in_the_log_whose_waits_explain_its_time(go, delivery):
    result = lossy(go, delivery)
    messages, packets = records(result, MessageEnded), records(result, PacketEnded)
    said = {kind: len(records(result, kind)) for kind in (Requested, TransitionTaken, ModeChanged)}
    for way, topics in (
        ("up", {"confirm": result.operator_acts}),
        ("down", {"request": said[Requested], "mirror": said[TransitionTaken], "mode": said[ModeChanged]}),
    ):
        mine = [m for m in messages if m.direction == way]
        assert sorted(m.number for m in mine) == list(range(len(mine)))
        assert {topic: sum(m.topic == topic for m in mine) for topic in topics} == topics
        # Copies are packets. One may be sent after its message is there, as long as no acknowledgement has come.
        for topic in topics:
            copies = sum(m.copies for m in mine if m.topic == topic)
            arrived = sum(m.outcome == "delivered" for m in mine if m.topic == topic)
            assert arrived <= copies <= sum(p.topic == topic and p.direction == way for p in packets)
    for m in messages:
        waits = (m.queue_s, m.blackout_s, m.serialisation_s, m.propagation_s, m.retransmission_s)
        assert min(waits) >= -1e-9
        assert (m.outcome == "delivered") == (m.delivered_s == m.t_s)
        # Sums of times below 2000 s.
        assert math.fsum(waits) == pytest.approx(m.t_s - m.sent_s, abs=1e-6)
    again_s = [m.retransmission_s for m in messages if m.outcome == "delivered"]
    assert max(again_s) > 2 * DELAY_S
    assert {m.outcome for m in messages} <= {"delivered", "in_flight"}
    assert len(load(result.log).messages) == len(messages)


def test_best_effort_has_no_fates_beside_those_of_its_packets(go):
    assert records(lossy(go, "best_effort"), MessageEnded) == []


def test_tcp_over_a_round_trip_beyond_its_patience_says_why_nothing_arrives(tmp_path):
    """22 minutes each way: no handshake ends in the 924.6 s after which TCP gives up."""
    changes = {"link.up": {}, "link.down": {}, "link.preset": "mars-far", "link.delivery": "tcp"}
    changes |= {"autonomy": "off", "pacing": "eager", "time_limit_s": 1000.0}
    result = run_scenario(load_scenario("src-dish", changes), SEED, tmp_path)
    assert result.outcome == "censored"
    messages = records(result, MessageEnded)
    lost = [m for m in messages if m.outcome == "dropped"]
    assert {(m.reason, m.copies) for m in lost} == {("no_connection", 0)}
    # All that was entrusted until then ends at that time; the next heartbeat, at 930 s, calls anew.
    assert [m.t_s for m in lost] == [pytest.approx(924.6)] * len(lost)
    later = [m for m in messages if m not in lost]
    assert {(m.outcome, m.copies) for m in later} == {("in_flight", 0)}
    assert max(m.sent_s for m in lost) < 924.6
    assert min(m.sent_s for m in later) == pytest.approx(930.0)
    assert {p.topic for p in records(result, PacketEnded)} == {"syn"}
    (total,) = [row for row in message_ledger(messages) if row.topic == ALL]
    assert total.reasons == f"no_connection {len(lost)}"


@pytest.mark.parametrize("heartbeat", ["state", "hash"])
def test_what_nobody_repeats_is_lost_and_a_heartbeat_brings_it_back(go, laws, heartbeat):
    """A request that the downlink loses is shown by the whole state, told or asked for; then it is answered."""
    changes = {key.replace(".", "__"): value for key, value in LOSSY.items()}
    result = go(f"told-{heartbeat}", link__delivery="best_effort", link__heartbeat=heartbeat, **changes)
    clean = go("clean")
    assert result.outcome == clean.outcome == "completed", result.cause
    rest_s = result.completion_time_s - math.fsum(round_trips_s(result))
    assert rest_s == pytest.approx(clean.completion_time_s - math.fsum(round_trips_s(clean)), abs=1e-6)
    packets = sorted((p for p in records(result, PacketEnded) if p.direction == "down"), key=lambda p: p.packet)
    asking = [p for p in packets if p.topic == "request"]
    answered_s = {r.request: r.t_s for r in records(result, Released) if r.effect == "answered"}
    told_s = [(p.sent_s, p.arrived_s) for p in packets if p.topic == "sync_state" and p.outcome == "delivered"]
    lost = [
        (p, answered_s[r.request])
        for p, r in zip(asking, records(result, Requested), strict=True)
        if p.outcome == "dropped"
    ]
    assert lost
    for p, answer_s in lost:
        assert p.reason == "lost"
        known_s = min(arrived_s for sent_s, arrived_s in told_s if sent_s >= p.sent_s)
        # Back go the delay, a header and a byte at least.
        assert answer_s > known_s + DELAY_S + 8 * (HEADER_BYTES + 1) / UP_BPS
    assert laws.broken_laws(load(result.log).records()) == []


def test_a_downlink_that_goes_dark_for_ever_leaves_the_run_where_it_asked(go, laws):
    dark_s, limit_s = 100.0, 200.0
    changes = {"link__down__blackouts": [[dark_s, math.inf]], "time_limit_s": limit_s}
    result = go("dark", link__delivery="best_effort", **changes)
    (last,) = [r for r in records(result, Requested) if r.t_s > dark_s]
    assert result.outcome == "censored"
    assert result.cause.startswith(f"time limit of 200 s reached in {last.state}, ")
    assert last.request not in {r.request for r in records(result, Released)}
    # It and the heartbeats of 100 s wait for light.
    down = [p for p in records(result, PacketEnded) if p.direction == "down" and p.sent_s >= dark_s]
    assert {p.outcome for p in down} == {"in_flight"}
    assert {"request", "sync_state"} <= {p.topic for p in down}
    assert laws.broken_laws(load(result.log).records()) == []


RESTLESS = {
    "time_limit_s": 120.0,
    "link.preset": "drc-trials-2013",
    "link.clock": "wall",
    "link.real_time_factor": 0.5,
    "link.delivery": {"model": "custody", "window": 8},
    "link.up": {"loss": {"model": "gilbert_elliott", "p_enter": 0.1, "p_leave": 0.5}, "mtu_bytes": 60},
    "link.down": {
        "dark": {"model": "random_gaps", "mean_light_s": 10.0, "mean_dark_s": 3.0},
        "jitter": {"model": "normal", "sd_s": 0.02, "clip_s": 0.04},
        "on_dark": "restart",
        "discipline": "priority",
        "priorities": {"request": 2, "ack": 3},
    },
}


def test_everything_at_once_gives_the_same_bytes_twice_and_another_link_for_another_seed(tmp_path):
    runs = [
        run_scenario(
            load_scenario("src-dish", {"autonomy": "off", "pacing": "eager"} | RESTLESS), seed, tmp_path / name
        )
        for name, seed in (("a", 1), ("b", 1), ("c", 2))
    ]
    first, again, other = (result.log.read_bytes() for result in runs)
    assert first == again
    dark = [load(result.log).blackouts for result in runs]
    assert len(dark[0]) > 3
    assert not dark[0].equals(dark[2])
    assert first != other
    urgent = {p.topic: p.priority for p in records(runs[0], PacketEnded) if p.direction == "down"}
    assert (urgent["request"], urgent["ack"], urgent["log"]) == (2, 3, 0)
    # The log's own scenario is the whole link, as it was.
    written = read_scenario(load(runs[0].log).scenario_toml, "log")
    assert link_problems(written) == ()
    assert run_scenario(written, 1, tmp_path / "d").log.read_bytes() == first


def test_a_rate_follows_the_machine_s_state(tmp_path):
    slow, fast = 400.0, 50e3
    by_state = [{"state": "STATE_DETECT_PANEL_COARSE", "rate_bps": fast}]
    changes = {"link.down.rate_bps": slow, "link.down.by_state": by_state, "time_limit_s": 60.0, "autonomy": "full"}
    result = run_scenario(load_scenario("src-dish", NEAR | changes), SEED, tmp_path)
    moves = records(result, TransitionTaken)
    edges = [(0.0, moves[0].state), *((m.t_s, m.next_state) for m in moves), (60.0, "")]
    seen = set()
    for p in (p for p in records(result, PacketEnded) if p.direction == "down" and p.outcome == "delivered"):
        out_s = p.arrived_s - DELAY_S
        for (from_s, state), (to_s, _) in pairwise(edges):
            if from_s <= p.service_s and out_s <= to_s:
                rate_bps = fast if state == by_state[0]["state"] else slow
                assert p.serialisation_s == pytest.approx(p.size_bits / rate_bps, abs=1e-6)
                seen.add(rate_bps)
    assert seen == {slow, fast}


def test_a_link_that_can_never_deliver_is_refused_before_a_log_is_begun(tmp_path):
    whole = load_scenario("src-dish")
    up = whole.link.up.model_copy(update={"budget_bits": 320})
    dumb = whole.model_copy(update={"link": whole.link.model_copy(update={"up": up})})
    with pytest.raises(BadInput, match="a budget of 320 bits is no more than one header"):
        run_scenario(dumb, 1, tmp_path / "none")
    assert not (tmp_path / "none").exists()
