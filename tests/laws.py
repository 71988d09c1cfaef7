"""Laws that every log must keep, whatever was run. Each law takes a ``Story`` and tells what breaks it.

Nothing here knows how the simulator works: only the records and the scenario that the log itself carries. Times that
are sums of floats may differ by ``EPS_S``.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import TypeVar

from teleop_sim.channel.link import DirectionSettings
from teleop_sim.core import records as rec
from teleop_sim.core.streams import stream
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.reports.shares import SHARES, where_time_went
from teleop_sim.scenarios.files import read_scenario
from teleop_sim.scenarios.links import link_plan
from teleop_sim.scenarios.objects import dish_settings
from teleop_sim.scenarios.schema import Scenario
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.console import SQUARE_M
from teleop_sim.world.dish_draw import DishWorld, draw_dish_world

EPS_S = 1e-6
"""Rounding of sums of some thousand times below 2000 s, with room to spare."""

TOLERANCE_RAD = math.radians(5.0)
HOLD_S = 5.0
"""Rules of the task: osrf/srcsim 0.8.0, SatellitePlugin.cc."""

SAMPLES_S = 0.2
"""The log keeps the plant five times a second while the robot acts."""

HANDS = frozenset({"reach", "grip", "follow", "release", "nudge"})
"""Skills in which a hand may touch a wheel."""

R = TypeVar("R", bound=rec.Record)
Law = Callable[["Story"], Iterator[str]]


@dataclass(frozen=True, eq=False)
class Story:
    """A log's records, in the order in which they were written."""

    records: tuple[rec.Record, ...]

    def all(self, kind: type[R]) -> list[R]:
        """Records of one kind."""
        return [r for r in self.records if isinstance(r, kind)]

    @cached_property
    def started(self) -> rec.RunStarted:
        return self.all(rec.RunStarted)[0]

    @cached_property
    def ended(self) -> rec.RunEnded:
        return self.all(rec.RunEnded)[0]

    @cached_property
    def scenario(self) -> Scenario:
        return read_scenario(self.started.scenario_toml, "the log's scenario")

    @cached_property
    def world(self) -> DishWorld:
        draw = partial(stream, self.started.seed, self.started.replicate)
        return draw_dish_world(draw, dish_settings(self.scenario.world))

    @cached_property
    def packets(self) -> dict[str, list[rec.PacketEnded]]:
        """By direction, in the order in which they were sent."""
        ordered = sorted(self.all(rec.PacketEnded), key=lambda p: p.packet)
        return {name: [p for p in ordered if p.direction == name] for name in ("up", "down")}

    @cached_property
    def asked_at_s(self) -> dict[int, float]:
        """When the operator got each request (infinite: never): by itself, or with a state that was told after it.

        Requests are sent in the order in which they are logged.
        """
        sent = [p for p in self.packets["down"] if p.topic == "request"]
        states = [p for p in self.packets["down"] if p.topic == "sync_state" and p.outcome == "delivered"]
        return {
            r.request: min(
                (q.arrived_s for q in (p, *(s for s in states if s.sent_s >= r.t_s)) if q.outcome == "delivered"),
                default=math.inf,
            )
            for r, p in zip(self.all(rec.Requested), sent, strict=True)
        }

    @cached_property
    def joints(self) -> dict[str, int]:
        """Place of each joint among a sample's."""
        return {name: i for i, name in enumerate(self.all(rec.PlantNames)[0].joints.split())}

    @cached_property
    def samples(self) -> list[rec.PlantSample]:
        return self.all(rec.PlantSample)

    def joint(self, sample: rec.PlantSample, name: str) -> float:
        return sample.joints[self.joints[name]]

    def sample_at(self, t_s: float) -> rec.PlantSample:
        """The newest sample at a time."""
        return self.samples[max(bisect_right(self.samples, t_s + EPS_S, key=lambda s: s.t_s) - 1, 0)]

    def checkpoint(self, number: int) -> float:
        """When a checkpoint was scored (NaN: never)."""
        mark = f"checkpoint {number}:"
        return next((s.t_s for s in self.all(rec.Scored) if s.text.startswith(mark)), math.nan)


def broken_laws(records: Iterable[rec.Record]) -> list[str]:
    """Everything that is wrong with a whole run's records, as ``law: what``; empty if all is well."""
    story = Story(tuple(records))
    return [f"{law.__name__}: {what}" for law in LAWS for what in law(story)]


def _apart(a: float, b: float) -> bool:
    return not abs(a - b) <= EPS_S


# Time ----------------------------------------------------------------------------------------------------------------


def times_never_go_back(story: Story) -> Iterator[str]:
    for a, b in pairwise(story.records):
        if b.t_s < a.t_s:
            yield f"{b} after {a}"
    for r in story.records:
        start_s = getattr(r, "start_s", getattr(r, "entered_s", r.t_s))
        if not 0.0 <= start_s <= r.t_s + EPS_S:
            yield f"starts after its end: {r}"


def a_run_has_one_start_and_one_end(story: Story) -> Iterator[str]:
    if not isinstance(story.records[0], rec.RunStarted) or not isinstance(story.records[-1], rec.RunEnded):
        yield "the first record is no start or the last is no end"
    if len(story.all(rec.RunStarted)) != 1 or len(story.all(rec.RunEnded)) != 1:
        yield "more than one start or end"
    if story.ended.t_s > story.started.time_limit_s + EPS_S:
        yield f"it ended at {story.ended.t_s}, after its limit {story.started.time_limit_s}"


def shares_of_time_add_up(story: Story) -> Iterator[str]:
    shares = where_time_went(story.records)
    total_s = sum(shares[key] for key in SHARES)
    if _apart(total_s, story.ended.t_s) or min(shares.values()) < 0.0:
        yield f"{shares} is not {story.ended.t_s}"


def the_robot_does_one_thing_at_a_time(story: Story) -> Iterator[str]:
    spans = [(r.start_s, r.t_s, r) for r in story.records if isinstance(r, rec.EpisodeEnded | rec.Waited)]
    for a, b in pairwise(sorted(spans, key=lambda s: s[:2])):
        if b[0] < a[1] - EPS_S:
            yield f"{b[2]} began before {a[2]} had ended"
    for e in story.all(rec.EpisodeEnded):
        if e.physics_s > e.t_s - e.start_s + EPS_S:
            yield f"more physics than time: {e}"


def an_operator_does_one_thing_at_a_time(story: Story) -> Iterator[str]:
    acts = story.all(rec.OperatorActed)
    for role in sorted({a.role for a in acts}):
        for a, b in pairwise(x for x in acts if x.role == role):
            if b.start_s < a.t_s - EPS_S:
                yield f"{b} began before {a} had ended"


# Link ----------------------------------------------------------------------------------------------------------------


def _settings(story: Story, name: str) -> DirectionSettings:
    plan = link_plan(story.scenario, partial(stream, story.started.seed, story.started.replicate))
    return plan.up.settings if name == "up" else plan.down.settings


def _dark_s(a_s: float, b_s: float, windows: Iterable[tuple[float, float]]) -> float:
    return sum(max(0.0, min(b_s, end_s) - max(a_s, start_s)) for start_s, end_s in windows)


def every_packet_ends_once(story: Story) -> Iterator[str]:
    for name, packets in story.packets.items():
        if [p.packet for p in packets] != list(range(len(packets))):
            yield f"{name}: numbers are not 0, 1, 2 ..."
        for p in packets:
            if p.outcome not in ("delivered", "dropped", "in_flight") or (p.outcome == "dropped") != bool(p.reason):
                yield f"strange fate: {p}"
            if p.outcome == "in_flight" and p.t_s != story.ended.t_s:
                yield f"in flight before the end: {p}"


BY_SOFTWARE = ("attach", "sync_request")


def sent_is_what_the_sites_said(story: Story) -> Iterator[str]:
    """Sent = delivered + dropped + in flight, by topic: what was sent is known from the sites' own records."""
    ended = {name: Counter(p.topic for p in packets) for name, packets in story.packets.items()}
    sent = {
        "mirror": len(story.all(rec.TransitionTaken)),
        "mode": len(story.all(rec.ModeChanged)),
        "request": len(story.all(rec.Requested)),
        "level": sum(r.effect == "level" for r in story.all(rec.Released)),
    }
    for topic, count in sent.items():
        if ended["down"][topic] != count:
            yield f"down {topic}: {count} sent, {ended['down'][topic]} ended"
    acts = sum(a.kind == "send" for a in story.all(rec.OperatorActed))
    # The station's own software asks for the state without anybody's act.
    by_hand = ended["up"].total() - sum(ended["up"][topic] for topic in BY_SOFTWARE)
    if by_hand != acts:
        yield f"up: {acts} sent, {by_hand} ended"


def waits_of_a_packet_add_up(story: Story) -> Iterator[str]:
    for p in story.all(rec.PacketEnded):
        waits = (p.queue_s, p.blackout_s, p.serialisation_s, p.propagation_s, p.retransmission_s)
        if _apart(sum(waits), p.t_s - p.sent_s) or min(waits) < -EPS_S:
            yield f"{waits} are not {p.t_s - p.sent_s}: {p}"
        if (p.outcome == "delivered") == math.isnan(p.arrived_s) or (p.outcome == "delivered" and p.arrived_s != p.t_s):
            yield f"arrived at another time than written: {p}"


def nothing_arrives_early(story: Story) -> Iterator[str]:
    for name, packets in story.packets.items():
        link = _settings(story, name)
        for p in packets:
            bits = 8 * (p.payload_bytes + link.header_bytes)
            if p.size_bits != bits:
                yield f"{bits} bits expected: {p}"
            if p.outcome == "delivered" and p.arrived_s < p.sent_s + bits / link.rate_bps + link.delay_s - EPS_S:
                yield f"faster than the link: {p}"


def bits_go_out_in_the_light_and_one_packet_at_a_time(story: Story) -> Iterator[str]:
    for name, packets in story.packets.items():
        link = _settings(story, name)
        free_s = 0.0
        for p in (p for p in packets if not math.isnan(p.service_s)):
            if any(a <= p.service_s < b - EPS_S for a, b in link.blackouts):
                yield f"first bit in the dark: {p}"
            if p.service_s < max(free_s, p.sent_s) - EPS_S:
                yield f"first bit before the packet ahead was out ({free_s}): {p}"
            if p.outcome == "delivered":
                free_s = p.arrived_s - link.delay_s
                light_s = free_s - p.service_s - _dark_s(p.service_s, free_s, link.blackouts)
                if _apart(light_s, p.size_bits / link.rate_bps):
                    yield f"{light_s} s of light for {p.size_bits} bits: {p}"


def blackouts_are_those_of_the_scenario(story: Story) -> Iterator[str]:
    for name in ("up", "down"):
        wanted = [(t, dark) for w in _settings(story, name).blackouts for t, dark in zip(w, (True, False), strict=True)]
        due = [(t, dark) for t, dark in wanted if t < story.ended.t_s - EPS_S]
        told = [(b.t_s, b.dark) for b in story.all(rec.Blackout) if b.direction == name]
        if len(told) < len(due) or any(_apart(a[0], b[0]) or a[1] != b[1] for a, b in zip(told, wanted, strict=False)):
            yield f"{name}: {told} instead of {due}"


# Requests, answers, commands -----------------------------------------------------------------------------------------


def answers_are_to_open_requests(story: Story) -> Iterator[str]:
    pending: int | None = None
    for r in story.records:
        match r:
            case rec.Requested():
                if pending is not None:
                    yield f"asked while {pending} was open: {r}"
                pending = r.request
            case rec.Released(effect="answered"):
                if r.request != pending:
                    yield f"open was {pending}: {r}"
                pending = None
            case rec.Released() if r.request:
                yield f"names a request but is no answer: {r}"
            case rec.TransitionTaken():
                pending = None


def round_trips_and_acts_are_counted(story: Story) -> Iterator[str]:
    answered = sum(r.effect == "answered" for r in story.all(rec.Released))
    acts = sum(a.kind == "send" for a in story.all(rec.OperatorActed))
    if (story.ended.round_trips, story.ended.operator_acts) != (answered, acts):
        yield f"{answered} answered and {acts} sent, but {story.ended}"


def the_operator_is_not_telepathic(story: Story) -> Iterator[str]:
    for act in (a for a in story.all(rec.OperatorActed) if a.request):
        if not act.start_s >= story.asked_at_s[act.request] - EPS_S:
            yield f"request {act.request} arrived at {story.asked_at_s[act.request]}: {act}"
    arrived = {(p.text, p.arrived_s) for p in story.packets["down"] if p.topic == "log"}
    for act in (a for a in story.all(rec.OperatorActed) if a.kind == "read"):
        text = act.text.removeprefix("dropped: ")
        if text != "picture" and not any(text == line and t <= act.start_s + EPS_S for line, t in arrived):
            yield f"read before it arrived: {act}"


def the_field_obeys_what_arrives_and_when(story: Story) -> Iterator[str]:
    """One effect a delivered command, at the instant of its arrival."""
    arrived = Counter(p.arrived_s for p in story.packets["up"] if p.outcome == "delivered")
    obeyed = Counter(r.t_s for r in story.all(rec.Released))
    if arrived != obeyed:
        yield f"arrived without effect: {arrived - obeyed}; effect without arrival: {obeyed - arrived}"


# Machine -------------------------------------------------------------------------------------------------------------


def transitions_chain(story: Story) -> Iterator[str]:
    machine = src_dish()
    state, since_s = machine.start, 0.0
    for t in story.all(rec.TransitionTaken):
        if t.state != state or t.entered_s != since_s:
            yield f"the machine was in {state} since {since_s}: {t}"
        if not machine.has_edge(t.state, t.event):
            yield f"no such outcome: {t}"
        else:
            edge = machine.edge(t.state, t.event)
            if (edge.next_state, edge.threshold) != (t.next_state, t.threshold):
                yield f"declared otherwise ({edge}): {t}"
        state, since_s = t.next_state, t.t_s


def the_guard_holds(story: Story) -> Iterator[str]:
    for t in story.all(rec.TransitionTaken):
        if t.how == "autonomous" and not (t.threshold < t.level or t.threshold == -1):
            yield f"passed by itself: {t}"
        if t.how == "confirmed" and t.threshold < t.level:
            yield f"needed no confirmation: {t}"
        commands = [r for r in story.all(rec.Released) if t.entered_s - EPS_S <= r.t_s <= t.t_s + EPS_S]
        if t.how == "confirmed" and not any(
            r.command.startswith("confirm ") and r.effect == "answered" for r in commands
        ):
            yield f"nobody confirmed: {t}"
        if t.how == "forced" and not any(r.command == t.event and r.effect in ("answered", "forced") for r in commands):
            yield f"nobody forced: {t}"


def modes_are_those_told(story: Story) -> Iterator[str]:
    mode = "normal"
    for r in story.records:
        if isinstance(r, rec.ModeChanged):
            if r.mode == mode:
                yield f"no change: {r}"
            mode = r.mode
        elif isinstance(r, rec.TransitionTaken) and r.mode != mode:
            yield f"told was {mode}: {r}"


def episodes_lie_in_their_visit(story: Story) -> Iterator[str]:
    """A movement that the operator commands himself may outlast the visit; whatever a program does may not."""
    direct = {r.t_s for r in story.all(rec.Released) if r.effect == "direct"}
    visits = [(t.state, t.entered_s, t.t_s) for t in story.all(rec.TransitionTaken)]
    last = visits[-1][2] if visits else 0.0
    state = story.all(rec.TransitionTaken)[-1].next_state if visits else src_dish().start
    visits.append((state, last, story.ended.t_s))
    for e in (r for r in story.records if isinstance(r, rec.EpisodeEnded | rec.Waited)):
        late = math.inf if e.start_s in direct else EPS_S
        if not any(e.state == s and a - EPS_S <= e.start_s and e.t_s <= b + late for s, a, b in visits):
            yield f"outside its state's visit: {e}"


# Plant and score -----------------------------------------------------------------------------------------------------


def nothing_moves_between_episodes(story: Story) -> Iterator[str]:
    """A sample outside an episode is the one before it, to the bit."""
    spans = [(e.start_s, e.t_s) for e in story.all(rec.EpisodeEnded)]
    for a, b in pairwise(story.samples):
        if not any(s - EPS_S <= b.t_s <= e + EPS_S for s, e in spans) and (a.pelvis, a.joints) != (b.pelvis, b.joints):
            yield f"moved at {b.t_s}, when nothing was done"


def motion_is_continuous(story: Story) -> Iterator[str]:
    """No jump of the pelvis: 3 m/s is faster than any fall from standing height in 0.2 s takes it."""
    for a, b in pairwise(story.samples):
        moved_m = math.dist(a.pelvis[:3], b.pelvis[:3])
        # Frozen time does not move it: only what lies in one sampling period counts.
        if moved_m > 3.0 * SAMPLES_S + 0.05:
            yield f"pelvis jumped {moved_m:.2f} m between {a.t_s} and {b.t_s}"


def the_dish_waits_for_checkpoint_1(story: Story) -> Iterator[str]:
    first_s = story.checkpoint(1)
    for s in story.samples:
        # A tick's control is set at its start: the dish follows from the tick after checkpoint 1 on.
        if not s.t_s > first_s and max(abs(story.joint(s, "dishYaw")), abs(story.joint(s, "dishPitch"))) > 1e-4:
            yield f"the dish moved by {s.t_s}, before checkpoint 1 at {first_s}"


def wheels_turn_only_by_hand(story: Story) -> Iterator[str]:
    """Unless the robot falls on them."""
    spans = [(e.start_s, e.t_s, e.skill) for e in story.all(rec.EpisodeEnded) if e.outcome != "fell"]
    for a, b in pairwise(story.samples):
        skill = next((k for s, e, k in spans if s + EPS_S < b.t_s <= e + EPS_S), "")
        for wheel in ("yawWheel", "pitchWheel"):
            turned = abs(story.joint(b, wheel) - story.joint(a, wheel))
            if skill and skill not in HANDS and turned > 1e-3:
                yield f"{wheel} turned {turned:.4f} rad in {skill} by {b.t_s}"


def checkpoints_are_earned(story: Story) -> Iterator[str]:
    times = [story.checkpoint(n) for n in (1, 2, 3, 4)]
    reached = [t for t in times if not math.isnan(t)]
    if reached != times[: len(reached)] or sorted(reached) != reached:
        yield f"checkpoints out of order: {times}"
    targets = dict(zip(("dishYaw", "dishPitch"), story.world.targets_rad, strict=True))
    yaw_s, pitch_s = (_in_tolerance_since(story, axis, target) for axis, target in targets.items())
    for number, needed in ((2, min), (3, max)):
        at_s = times[number - 1]
        if not math.isnan(at_s) and not at_s - needed(yaw_s(at_s), pitch_s(at_s)) > HOLD_S - SAMPLES_S:
            yield f"checkpoint {number} at {at_s}: held since {yaw_s(at_s)} (yaw), {pitch_s(at_s)} (pitch)"
    for number, square, side_m in (
        (1, lay.checkpoint_1(story.world.dish), lay.CHECKPOINT_SIDE_M),
        (4, story.world.finish, SQUARE_M),
    ):
        at_s = times[number - 1]
        # 5 cm: how far the pelvis may move between two samples that the log keeps.
        if not math.isnan(at_s) and not lay.inside(square, side_m + 0.1, *story.sample_at(at_s + SAMPLES_S).pelvis[:2]):
            yield f"checkpoint {number} at {at_s}: the pelvis was at {story.sample_at(at_s).pelvis[:2]}"


def _in_tolerance_since(story: Story, axis: str, target: float) -> Callable[[float], float]:
    """Since when an axis has been within tolerance at a time, by the samples kept; ``inf``: it was not."""

    def since_s(at_s: float) -> float:
        found = math.inf
        for s in reversed([s for s in story.samples if s.t_s <= at_s + SAMPLES_S]):
            if abs(story.joint(s, axis) - target) >= TOLERANCE_RAD:
                # Right after the present sample lies one that may be out again.
                if s.t_s > at_s:
                    continue
                return min(found, at_s)
            found = s.t_s
        return found

    return since_s


def the_end_says_what_happened(story: Story) -> Iterator[str]:
    end, reached = story.ended, max((s.checkpoint for s in story.all(rec.Scored)), default=0)
    taken = story.all(rec.TransitionTaken)
    state = taken[-1].next_state if taken else src_dish().start
    if (end.outcome == "completed") == bool(end.cause) or end.outcome not in ("completed", "failed", "censored"):
        yield f"cause and outcome do not fit: {end}"
    if end.outcome == "completed" and (reached != 4 or state != "STATE_END" or end.completion_time_s != end.t_s):
        yield f"checkpoint {reached}, {state}: {end}"
    if end.outcome != "completed" and not math.isnan(end.completion_time_s):
        yield f"a completion time without completion: {end}"
    if end.outcome == "censored" and (_apart(end.t_s, story.started.time_limit_s) or state not in end.cause):
        yield f"not at the limit, or not in {state}: {end}"
    if "checkpoint" in end.cause and f"checkpoint {reached} of 4" not in end.cause:
        yield f"checkpoint {reached} was scored: {end}"
    fell = [e for e in story.all(rec.EpisodeEnded) if e.outcome == "fell"]
    if bool(fell) != (end.outcome == "failed" and end.cause.startswith("fell")):
        yield f"{len(fell)} falls: {end}"
    if fell and end.cause not in (fell[0].cause, fell[-1].cause):
        yield f"the log tells another cause, {[e.cause for e in fell]}: {end}"


LAWS: tuple[Law, ...] = (
    times_never_go_back,
    a_run_has_one_start_and_one_end,
    shares_of_time_add_up,
    the_robot_does_one_thing_at_a_time,
    an_operator_does_one_thing_at_a_time,
    every_packet_ends_once,
    sent_is_what_the_sites_said,
    waits_of_a_packet_add_up,
    nothing_arrives_early,
    bits_go_out_in_the_light_and_one_packet_at_a_time,
    blackouts_are_those_of_the_scenario,
    answers_are_to_open_requests,
    round_trips_and_acts_are_counted,
    the_operator_is_not_telepathic,
    the_field_obeys_what_arrives_and_when,
    transitions_chain,
    the_guard_holds,
    modes_are_those_told,
    episodes_lie_in_their_visit,
    nothing_moves_between_episodes,
    motion_is_continuous,
    the_dish_waits_for_checkpoint_1,
    wheels_turn_only_by_hand,
    checkpoints_are_earned,
    the_end_says_what_happened,
)
