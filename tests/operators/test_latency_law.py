"""The reaction to the n-th request does not depend on the link: through the real link, executive and mirror."""

from dataclasses import dataclass

import numpy as np
import pytest
import simpy

from teleop_sim.channel.link import Direction, DirectionSettings
from teleop_sim.channel.messages import (
    MODES,
    Chat,
    Confirm,
    LevelIs,
    LogLine,
    MirrorUpdate,
    ModeIs,
    Request,
    Withdrawn,
    decode_payload,
    encode_message,
)
from teleop_sim.core.records import OperatorActed, Record, Released, Requested
from teleop_sim.machines.executive import Executive, Result, Start
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.crew import Crew
from teleop_sim.operators.timing import load_timing

DISH = src_dish()
OFF, FULL = 0, 3
RATE_BPS = 380.0
# Three lines take 12 s to read, longer than a program runs: reading is always under way when a request arrives, and how
# much of it gets done between requests depends on the latency.
LINES, LINE = 3, " ".join(["word"] * 13)


@dataclass
class Site:
    """A field site without a robot: every program takes 7.3 s and succeeds; the first of ``failing`` fails once."""

    env: simpy.Environment
    down: Direction | None = None
    failing: str = ""

    def start_program(self, start: Start) -> simpy.Process:
        return self.env.process(self._program(start.path))

    def _program(self, state: str):
        for _ in range(LINES):
            self._tell(LogLine(float(self.env.now), LINE))
        yield self.env.timeout(7.3)
        kind = "done"
        if state == self.failing:
            self.failing, kind = "", "failed"
        return next(e.event for e in DISH.outcomes_of(state) if e.kind == kind), ""

    def _tell(self, message) -> None:
        self.down.send(*encode_message(message))

    # What the executive says, as messages

    def transition(self, edge: int) -> None:
        self._tell(MirrorUpdate(edge))

    def mode(self, mode: str) -> None:
        self._tell(ModeIs(MODES.index(mode)))

    def level(self, level: int) -> None:
        self._tell(LevelIs(level))

    def request(self, request: int, kind: str, node: int, edge: int) -> None:
        self._tell(Request(request, kind, node, edge))

    def withdrawn(self, request: int) -> None:
        self._tell(Withdrawn(request))

    def line(self, text: str) -> None:
        self._tell(LogLine(float(self.env.now), text))


@dataclass(frozen=True)
class Run:
    """``result`` is None when the time limit came first."""

    result: Result | None
    ended_s: float
    records: tuple[Record, ...]

    def reactions_s(self) -> list[float]:
        """Beginning of deciding to the last key, by request."""
        acts = [r for r in self.records if isinstance(r, OperatorActed) and r.request]
        first = {a.request: a.start_s for a in reversed(acts)}
        return [a.t_s - first[a.request] for a in acts if a.kind == "send"]


def play(delay_s: float, level: int, failing: str = "", dark: bool = False, limit_s: float = 1800.0) -> Run:
    env: simpy.Environment = simpy.Environment()
    records: list[Record] = []
    site = Site(env, failing=failing)
    executive = Executive(env, DISH, level, site.start_program, site, records.append)

    def obey(payload: bytes) -> None:
        match decode_payload(payload):
            case Confirm(request=number):
                executive.confirm(number)
            case Chat(text=text) if text.startswith("/"):
                executive.force(text)

    blackouts = ((0.0, float("inf")),) if dark else ()
    up = Direction(env, "up", DirectionSettings(RATE_BPS, delay_s, 8, blackouts), obey, records.append)
    person = Crew(
        env, Mirror(DISH, level), up.send, load_timing(), np.random.default_rng(1), records.append,
        Briefing(2.0 * delay_s, RATE_BPS),
    )  # fmt: skip
    site.down = Direction(env, "down", DirectionSettings(50_000.0, delay_s, 8), person.receive, records.append)
    env.process(person.run())
    machine = env.process(executive.run())
    env.run(machine | env.timeout(limit_s))
    return Run(machine.value if machine.processed else None, float(env.now), tuple(records))


@pytest.mark.parametrize("failing", ["", "STATE_CORRECT_YAW"])
def test_completion_time_at_level_off_grows_with_the_number_of_round_trips(failing):
    near = play(0.0, OFF, failing)
    for delay_s in (0.7, 5.0, 10.0, 20.0):
        far = play(delay_s, OFF, failing)
        assert far.result == near.result
        assert far.result.outcome == "completed"
        trips = sum(isinstance(r, Released) and r.effect == "answered" for r in far.records)
        assert trips == far.result.round_trips > 0
        # Rounding of some hundred additions of times below 2000 s: far below a microsecond.
        assert far.ended_s - near.ended_s == pytest.approx(2.0 * delay_s * trips, abs=1e-9)


@pytest.mark.parametrize("failing", ["", "STATE_CORRECT_YAW"])
def test_reactions_are_the_same_at_every_latency(failing):
    near, far = play(0.0, OFF, failing), play(10.0, OFF, failing)
    assert len(near.reactions_s()) == len(far.reactions_s()) >= 10
    assert near.reactions_s() == pytest.approx(far.reactions_s(), abs=1e-9)


def test_attention_is_free_the_moment_a_request_arrives():
    far = play(10.0, OFF)
    asked = [r.t_s for r in far.records if isinstance(r, Requested)]
    begun = [r.start_s for r in far.records if isinstance(r, OperatorActed) and r.kind == "decide"]
    # A request has 6 bytes and 8 of header; the mirror's update may go out just before it.
    wait_s = [b - a - 10.0 for a, b in zip(asked, begun, strict=True)]
    assert min(wait_s) >= 0.0
    assert max(wait_s) == pytest.approx(min(wait_s), abs=1e-9)


def test_at_full_autonomy_latency_changes_nothing():
    near, far = play(0.0, FULL), play(10.0, FULL)
    assert near.result.round_trips == far.result.round_trips == 0
    assert near.ended_s == far.ended_s
    assert not [r for r in far.records if isinstance(r, OperatorActed) and r.kind == "send"]


def test_with_a_dark_uplink_nothing_the_operator_does_has_any_effect():
    run = play(10.0, OFF, dark=True, limit_s=5000.0)
    assert run.result is None
    assert run.ended_s == 5000.0
    assert not [r for r in run.records if isinstance(r, Released)]
    sends = [r.t_s for r in run.records if isinstance(r, OperatorActed) and r.kind == "send"]
    assert len(sends) > 3
    assert np.all(np.diff(sends, 2) > 0.0)
