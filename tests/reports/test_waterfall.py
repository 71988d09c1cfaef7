"""Where the time went: exact sums in every shipped scenario, and an oracle that asks for one instant at a time."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import teleop_sim
from teleop_sim.channel.messages import MESSAGES
from teleop_sim.core.records import (
    Blackout,
    EpisodeEnded,
    Layer,
    MessageEnded,
    OperatorActed,
    PacketEnded,
    PlantSample,
    Record,
    Released,
    Requested,
    RunEnded,
    Waited,
)
from teleop_sim.reports.lanes import SKILLS
from teleop_sim.reports.ledger import ledger
from teleop_sim.reports.shares import SHARES, where_time_went
from teleop_sim.reports.waterfall import CAUSES, HEARTBEATS, MOTIONS, WORK, spans_by_cause, time_by_cause
from teleop_sim.reports.ways import PHASES, darkness_ns, ways
from teleop_sim.robot.memo import Memo
from teleop_sim.run import run_scenario
from teleop_sim.scenarios.library import list_scenarios

NAN = math.nan


def kept(result) -> list[Record]:
    return [r for r in teleop_sim.load(result.log).records() if not isinstance(r, PlantSample)]


def ended_s(records: list[Record]) -> float:
    ended = records[-1]
    assert isinstance(ended, RunEnded)
    if ended.outcome == "completed":
        assert ended.completion_time_s == ended.t_s
    return ended.t_s


def check_sum(records: list[Record]) -> None:
    """To the nanosecond, which is finer than the microsecond that is asked for."""
    parts = time_by_cause(records)
    assert list(parts) == list(CAUSES)
    assert min(parts.values()) >= 0
    assert sum(parts.values()) == round(ended_s(records) * 1e9)
    shares = where_time_went(records)
    for group in SHARES:
        assert shares[group] == sum(ns for key, ns in parts.items() if CAUSES[key].group == group) / 1e9


@pytest.mark.parametrize("name", list_scenarios())
def test_the_parts_of_every_shipped_scenario_are_its_completion_time(name, tmp_path):
    check_sum(kept(run_scenario(teleop_sim.load_scenario(name), 1, tmp_path)))


DARK = [[30.0, 55.0], [90.0, 130.0]]
LINKS = {
    "plain": {},
    "dark": {"link.up.blackouts": DARK, "link.down.blackouts": DARK, "link.down.on_dark": "restart"},
    "thin": {"link.down.rate_bps": 300.0, "link.down.mtu_bytes": 60, "link.down.discipline": "priority",
             "link.down.priorities": {"request": 1}},
    "lossy": {"link.up.loss": {"model": "bernoulli", "p": 0.4}, "link.down.loss": {"model": "bernoulli", "p": 0.4}},
    "repeated": {"link.delivery": "selective_repeat", "link.up.loss": {"model": "bernoulli", "p": 0.3}},
}  # fmt: skip


@pytest.fixture(scope="module")
def asked(tmp_path_factory) -> dict[str, list[Record]]:
    """The beginning of the dish over links of all kinds: what the robot does is computed once."""
    memo, out = Memo(500_000_000), tmp_path_factory.mktemp("links")
    short = {"autonomy": "off", "time_limit_s": 200.0}
    runs = {
        f"{link}, {level}, {seed}": {**short, "autonomy": level, **tables}
        for link, tables in LINKS.items()
        for level, seed in (("off", 1), ("off", 2), ("low", 1))
    }
    return {
        name: kept(run_scenario(teleop_sim.load_scenario("src-dish", tables), int(name[-1]), out / name, memo=memo))
        for name, tables in runs.items()
    }


def test_and_of_every_level_and_seed_over_every_kind_of_link(asked):
    for records in asked.values():
        check_sum(records)


def test_the_link_is_seen_for_what_it_does(asked):
    seen = {name: time_by_cause(records) for name, records in asked.items()}
    assert seen["dark, off, 1"]["up_blackout_s"] + seen["dark, off, 1"]["down_blackout_s"] > 0
    assert seen["thin, off, 1"]["down_queue_s"] > 0
    assert seen["lossy, off, 1"]["lost_s"] > 0
    assert seen["repeated, off, 1"]["up_retransmission_s"] + seen["repeated, off, 2"]["up_retransmission_s"] > 0
    assert seen["plain, off, 1"]["lost_s"] == 0


def test_a_round_trip_is_in_the_air_for_as_long_as_the_link_is(asked):
    records = asked["plain, off, 1"]
    parts = time_by_cause(records)
    trips = sum(isinstance(r, Released) and r.effect == "answered" for r in records)
    pending = sum(isinstance(r, Requested) for r in records) - trips
    # 10 s each way; the last may have been cut short. 2 ns of rounding for each.
    assert parts["up_propagation_s"] == pytest.approx(trips * 10e9, abs=pending * 10e9 + 4 * trips)
    assert trips * 10e9 - 4 * trips <= parts["down_propagation_s"] <= (trips + pending) * 10e9 + 4 * trips


@pytest.mark.parametrize("link", [name for name in LINKS if name != "repeated"])
def test_what_packets_waited_for_is_what_the_ledger_says(asked, link):
    """Two ways to one sum: the instants of every packet's way, and the figures of its record."""
    records = asked[f"{link}, off, 1"]
    delivered = [r for r in records if isinstance(r, PacketEnded) and r.outcome == "delivered"]
    darkness = darkness_ns(records)
    sums = {(d, phase): 0 for d in ("up", "down") for phase in PHASES}
    for way in ways(delivered):
        for phase, spans in way.phases(darkness[way.direction]).items():
            sums[way.direction, phase] += sum(b - a for a, b in spans)
    for row in ledger(records):
        if row.topic == "all":
            for phase in PHASES:
                # Rounding of each end of each packet's waits.
                wanted_s = getattr(row.counts, f"{phase}_s")
                assert sums[row.direction, phase] / 1e9 == pytest.approx(wanted_s, abs=4e-9 * len(delivered))


# Made-up runs on a grid of whole seconds, asked at every half second: nothing lies on an edge.

LAST_S = 20
TIME = st.integers(0, LAST_S)
SPAN = st.tuples(TIME, TIME).map(sorted)


@st.composite
def packets(draw):
    start_s, end_s = draw(SPAN)
    cuts = sorted(draw(st.tuples(*[st.integers(start_s, end_s)] * 3)))
    direction = draw(st.sampled_from(("up", "down")))
    topics = ("confirm", "ack") if direction == "up" else ("request", "image", "sync_state")
    lost = draw(st.booleans())
    queue_s, again_s, bits_s, air_s = (b - a for a, b in zip((start_s, *cuts), (*cuts, end_s), strict=True))
    times = {"sent_s": float(start_s), "queue_s": float(queue_s), "blackout_s": 0.0, "serialisation_s": float(bits_s)}
    times |= {"propagation_s": float(air_s), "retransmission_s": float(again_s)}
    fate = {"outcome": "dropped" if lost else "delivered", "reason": "lost" if lost else "", "text": ""}
    what = {"t_s": float(end_s), "direction": direction, "topic": draw(st.sampled_from(topics)), "payload_bytes": 1}
    arrived_s = NAN if lost else float(end_s)
    if draw(st.booleans()):
        return MessageEnded(**what, **times, **fate, number=0, delivered_s=arrived_s, copies=1)
    return PacketEnded(**what, **times, **fate, packet=0, size_bits=8, service_s=NAN, arrived_s=arrived_s)


@st.composite
def made_up(draw):
    skills = st.sampled_from((*SKILLS, "juggle"))
    records = [EpisodeEnded(b, a, "A", s, "", "done", "", 1.0) for (a, b), s in draw(some(st.tuples(SPAN, skills)))]
    records += [Waited(b, a, "A", "pacing", "") for a, b in draw(some(SPAN))]
    kinds = st.tuples(SPAN, st.sampled_from((*WORK, "dream")), st.integers(0, 1))
    records += [OperatorActed(b, a, "supervisor", k, n, "") for (a, b), k, n in draw(some(kinds))]
    records += [Layer(b, a, "alignment", "") for a, b in draw(some(SPAN, 2))]
    for i, (a, b) in enumerate(draw(some(SPAN, 3)), start=1):
        records += [Requested(a, i, "confirm", "A", "e", ""), Released(b, i, "", "answered", "")]
    records += draw(some(packets(), 6))
    if draw(st.booleans()):
        a, b = draw(SPAN)
        records += [Blackout(a, "up", True), Blackout(b, "up", False)]
    rank = {Requested: 0, Released: 1}
    records.sort(key=lambda r: (r.t_s, rank.get(type(r), 0)))
    return [*records, RunEnded(float(draw(TIME)), "censored", "", NAN, 0, 0)]


def some(what, most=4):
    return st.lists(what, max_size=most)


def cause_at(records, t_s) -> str:
    """What the instant counts for, by the words of the module alone."""

    def now(r):
        return r.start_s < t_s < r.t_s

    kinds = {SKILLS.get(r.skill, "other") for r in records if isinstance(r, EpisodeEnded) and now(r)}
    for kind in MOTIONS:
        if kind in kinds:
            return f"robot_{kind}_s"
    if any(isinstance(r, Waited) and now(r) for r in records):
        return "pacing_s"
    answers = {r.request: r.t_s for r in records if isinstance(r, Released)}
    if not any(isinstance(r, Requested) and r.t_s < t_s < answers[r.request] for r in records):
        return "other_s"
    acknowledged = {r.direction for r in records if isinstance(r, MessageEnded)}
    sent = [
        r
        for r in records
        if isinstance(r, MessageEnded) or (isinstance(r, PacketEnded) and r.direction not in acknowledged)
    ]
    critical = [r for r in sent if r.topic == "request" or (r.direction == "up" and r.topic in MESSAGES)]
    for direction in ("up", "down"):
        if cause := way_at([r for r in critical if r.direction == direction], records, t_s):
            return cause
    if cause := work_at(records, t_s):
        return cause
    ends_s = [(r.t_s, r.outcome == "dropped") for r in critical if r.t_s < t_s]
    turn_s = max([e for e, _ in ends_s] + [r.sent_s for r in critical if r.sent_s < t_s], default=NAN)
    last = [lost for e, lost in ends_s if e == turn_s]
    if any(last):
        return "lost_s"
    news = [r for r in sent if r.direction == "down" and r.topic not in HEARTBEATS]
    return way_at(news, records, t_s) or ("operator_idle_s" if last else "lost_s")


def way_at(sent: list[Record], records: list[Record], t_s: float) -> str:
    here = [r for r in sent if r.sent_s < t_s < r.t_s]
    if not here:
        return ""
    oldest_s = min(r.sent_s for r in here)
    # Of two offered at once it may be either: records of messages come first, then in the order of their ends.
    first = sorted((r for r in here if r.sent_s == oldest_s), key=lambda r: isinstance(r, PacketEnded))[0]
    out_s = first.t_s - first.propagation_s
    turns = [(r.t_s, r.dark) for r in records if isinstance(r, Blackout) and r.direction == first.direction]
    dark = {k + 0.5 for k in range(LAST_S) if turns and turns[0][0] < k + 0.5 < turns[1][0]}
    if t_s > out_s:
        return f"{first.direction}_propagation_s"
    if t_s in dark:
        return f"{first.direction}_blackout_s"
    light_after = sum(1 for k in range(LAST_S) if t_s < k + 0.5 < out_s and k + 0.5 not in dark)
    if light_after < first.serialisation_s:
        return f"{first.direction}_serialisation_s"
    again = light_after < first.serialisation_s + first.retransmission_s
    return f"{first.direction}_{'retransmission' if again else 'queue'}_s"


def work_at(records: list[Record], t_s: float) -> str:
    acts = [r for r in records if isinstance(r, OperatorActed) and r.start_s < t_s < r.t_s]
    laying = any(isinstance(r, Layer) and r.start_s < t_s < r.t_s for r in records)
    kinds = {"else" if r.kind not in WORK or not (r.request or r.kind == "talk") else r.kind for r in acts}
    kinds |= {"align"} if "decide" in kinds and laying else set()
    return next((f"operator_{kind}_s" for kind in WORK if kind in kinds), "")


@given(made_up())
def test_every_instant_counts_for_what_the_module_says(records):
    spans = spans_by_cause(records)
    check_sum(records)
    for k in range(int(records[-1].t_s)):
        t_ns = k * 1_000_000_000 + 500_000_000
        found = [key for key, some_spans in spans.items() if any(a < t_ns < b for a, b in some_spans)]
        assert found == [cause_at(records, t_ns / 1e9)]


@given(made_up(), st.floats(0.1, 10.0))
def test_any_times_add_up_exactly(records, stretch):
    """Also where times are no whole numbers and nothing fits the grid."""

    def times(r: Record) -> dict[str, object]:
        return {name: value * stretch if name.endswith("_s") else value for name, value in vars(r).items()}

    check_sum([type(r)(**times(r)) for r in records])


def test_nothing_takes_no_time():
    assert set(time_by_cause([]).values()) == {0}
    assert spans_by_cause([]) == {key: [] for key in CAUSES}
