"""Policies that change the level, and that fall back a layer: pure functions of what has arrived."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from teleop_sim.channel.messages import (
    Chat,
    Confirm,
    Force,
    HandBack,
    LevelIs,
    LogLine,
    Message,
    MirrorUpdate,
    Request,
    SetLevel,
    SyncRequest,
    TakeOver,
    Withdrawn,
)
from teleop_sim.machines.mirror import Mirror
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.adaptive import Adaptive
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.station import tell
from teleop_sim.operators.step_down import StepDown

DISH = src_dish()
STATE, RETRY, DONE = "STATE_DETECT_PANEL_COARSE", "/DETECT_PANEL_RETRY", "/DETECTED_PANEL"
NEAR = Briefing(round_trip_s=1.0, uplink_bps=1e4, heartbeat_s=10.0)
FAR = Briefing(round_trip_s=20.0, uplink_bps=1e4, heartbeat_s=10.0)
RNG = np.random.default_rng(1)


def belief_of(level: int, *arrived: tuple[float, Message]) -> Belief:
    belief = Belief(Mirror(DISH, level))
    for t_s, message in arrived:
        tell(belief.mirror, message)
        belief.take(message, t_s)
    return belief


def moved(state: str, event: str) -> MirrorUpdate:
    return MirrorUpdate(DISH.edge_index(state, event))


def asked(number: int, event: str) -> Request:
    return Request(number, "confirm", DISH.net.by_path[STATE], DISH.edge_index(STATE, event))


# Level by link and failures


@pytest.mark.parametrize(("trip_s", "level"), [(0.5, 1), (5.0, 2), (40.0, 3)])
def test_the_level_follows_the_round_trip_that_was_announced(trip_s, level):
    told = Briefing(trip_s, 1e4)
    for now in range(4):
        belief = belief_of(now, (1.0, LogLine(0.0, "hello")))
        want = () if now == level else (SetLevel(level),)
        assert Adaptive().advise(belief, 2.0, told) == want


def test_the_round_trip_that_is_seen_counts_more_than_the_one_announced():
    belief = belief_of(2, (1.0, asked(1, DONE)))
    belief.note_sent(Confirm(1), 1, 5.0)
    tell(belief.mirror, Withdrawn(1))
    belief.take(Withdrawn(1), 35.0)
    assert belief.trip_s == pytest.approx(30.0)
    assert Adaptive().advise(belief, 36.0, NEAR) == (SetLevel(3),)


def test_a_round_trip_near_a_bound_changes_nothing():
    for level in (1, 2):
        assert Adaptive().advise(belief_of(level, (1.0, LogLine(0.0, "hi"))), 2.0, Briefing(2.1, 1e4)) == ()


def test_failures_lower_the_level_until_they_are_forgotten():
    policy = Adaptive()
    belief = belief_of(3, (1.0, moved(STATE, RETRY)), (5.0, moved(STATE, RETRY)))
    assert policy.advise(belief, 6.0, FAR) == (SetLevel(2),)
    belief.note_sent(SetLevel(2), 0, 6.0)
    # Not again before it can have worked.
    assert policy.advise(belief, 7.0, FAR) == ()
    tell(belief.mirror, LevelIs(2))
    belief.take(LevelIs(2), 26.0)
    assert policy.advise(belief, 30.0, FAR) == ()
    # The first failure is 120 s old.
    due_s = policy.wake_s(belief, 100.0, FAR)
    assert due_s == 121.0
    belief.take(LogLine(0.0, "beat"), 120.0)
    assert policy.advise(belief, due_s, FAR) == (SetLevel(3),)


def test_a_link_that_falls_silent_is_noticed_and_the_whole_state_asked_for():
    policy, belief = Adaptive(), belief_of(1, (50.0, LogLine(0.0, "last words")))
    assert policy.advise(belief, 60.0, NEAR) == ()
    due_s = policy.wake_s(belief, 60.0, NEAR)
    assert due_s == 80.0
    assert policy.advise(belief, due_s, NEAR) == (SyncRequest(),)
    belief.note_sent(SyncRequest(), 0, due_s)
    assert policy.advise(belief, due_s + 1.0, NEAR) == (SetLevel(3),)


@pytest.mark.parametrize("level", range(4))
@pytest.mark.parametrize("now_s", [0.0, 1.0, 80.0, 500.0])
@pytest.mark.parametrize("policy", [Adaptive(), StepDown()])
def test_a_policy_is_asked_again_later_and_not_at_once(policy, now_s, level):
    belief = belief_of(level, (0.5, moved(STATE, RETRY)), (0.6, moved(STATE, RETRY)))
    belief.note_sent(SetLevel(1), 0, 0.7)
    belief.note_sent(TakeOver(1), 0, 0.7)
    assert policy.wake_s(belief, now_s, NEAR) > now_s


# Layers


@dataclass(frozen=True)
class Two:
    """Both layers have something for one state: the template layer one command, teleoperation two movements."""

    state: str = STATE
    steps: dict[str, int] = field(default_factory=lambda: {"template": 1, "teleoperation": 2})

    def layers(self, _belief, state, /):
        return tuple(self.steps) if state == self.state else ()

    def move(self, _belief, _state, layer, step, _rng, /):
        return Chat("*0 1 0.01 0.0 0.0") if step < self.steps[layer] else None


def moves(policy: StepDown, belief: Belief, request: Request) -> int:
    """Movements by hand until the policy has had enough."""
    step = 0
    while policy.move(belief, request, step, RNG) is not None:
        belief.note_move(request)
        step += 1
    return step


def test_the_cascade_of_layers_and_the_way_back():
    policy, node = StepDown(manual=Two()), DISH.net.by_path[STATE]
    # The first failure may pass, the second is done by hand.
    belief = belief_of(0, (1.0, asked(1, RETRY)))
    assert policy.answer(belief, asked(1, RETRY)) == (Confirm(1),)
    belief = belief_of(0, (1.0, moved(STATE, RETRY)), (9.0, asked(2, RETRY)))
    assert policy.answer(belief, asked(2, RETRY)) == (TakeOver(node),)
    for number, steps in ((3, 1), (4, 2)):
        act = Request(number, "act", node)
        assert moves(policy, belief, act) == steps
        (forced,) = policy.answer(belief, act)
        assert forced == Force(DISH.edge_index(STATE, DONE), belief.mirror.seen)
        belief.note_in_lieu(STATE)
    # No layer is left: the behaviour has it back, and keeps it.
    act = Request(5, "act", node)
    assert moves(policy, belief, act) == 0
    assert policy.answer(belief, act) == (HandBack(5),)
    assert policy.answer(belief, asked(6, RETRY)) == (Confirm(6),)


def test_a_state_that_failed_by_itself_is_taken_over_when_it_is_at_work_again():
    policy, node = StepDown(manual=Two()), DISH.net.by_path[STATE]
    here = moved("STATE_INIT", "/REGULAR"), moved(STATE, RETRY), moved(STATE, RETRY)
    belief = belief_of(3, *((float(i), m) for i, m in enumerate(here)))
    belief.mirror.transition(DISH.edge_index("STATE_INIT", "/REGULAR"))
    assert belief.mirror.states == (STATE,)
    assert policy.advise(belief, 10.0, NEAR) == (TakeOver(node),)
    belief.note_sent(TakeOver(node), 0, 10.0)
    assert policy.advise(belief, 11.0, NEAR) == ()
    again_s = policy.wake_s(belief, 11.0, NEAR)
    assert policy.advise(belief, again_s, NEAR) == (TakeOver(node),)


def test_success_wipes_failures_out():
    belief = belief_of(3, (1.0, moved(STATE, RETRY)), (2.0, moved(STATE, DONE)))
    assert belief.failed == {}
    assert belief.failed_s == (1.0,)


def test_without_anything_to_do_by_hand_it_is_as_supervise():
    belief = belief_of(0, (1.0, moved(STATE, RETRY)), (2.0, moved(STATE, RETRY)), (9.0, asked(2, RETRY)))
    assert StepDown().answer(belief, asked(2, RETRY)) == (Confirm(2),)
    assert StepDown().advise(belief, 10.0, NEAR) == ()
