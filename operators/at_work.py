"""What has arrived of work with a template: what came of steps, where hands are, what plans were shown.

Made of messages and of what the crew itself did; nothing else (``belief.py``).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from teleop_sim.channel.messages import FootstepPlan, HandCloud, HandPose, Message, StepDone, TemplateStep, VoxelCloud
from teleop_sim.machines.declare import Machine

LOST: Final = frozenset({"blocked", "no_plan", "no_motion", "grip_lost", "refused", "timed_out", "stopped"})
"""Outcomes after which nothing is as it should be."""

TOLD: Final = frozenset({StepDone, HandPose, HandCloud, FootstepPlan, VoxelCloud})
"""Messages that say something of it."""

ASIDE: Final = ("push", "back", "wrist", "joint_limit", "insert", "extract", "test")
"""Parts of the names of states and affordances that do not turn the thing on."""

NO_PLANS: Final = 2
"""So many steps in a row that find no way make people doubt the world model (assumed)."""

AT_ONCE_S: Final = 1.0
"""A state that was seen for a shorter time has not walked (assumed: less than a step)."""

WALKS: Final = "ExecuteStepPlan"
"""How the programs of ViGIR's states that walk begin."""


@dataclass(frozen=True)
class Felt:
    """What came of a step.

    Attributes:
        t_s: when it was told.
        done: by the message.
        what: the affordance that somebody here had ordered, else the state at work: what shows whether it was a push.

    """

    t_s: float
    done: StepDone
    what: str

    @property
    def is_push(self) -> bool:
        """Was it a push, and no turn?"""
        return self.done.step == "affordance" and "push" in self.what.lower()

    @property
    def is_turn(self) -> bool:
        """Was it a turn that brings the task on, and none back or of the hand alone?"""
        what = self.what.lower()
        return self.done.step == "affordance" and not any(word in what for word in ASIDE)


@dataclass
class AtWork:
    """Evidence of work with a template.

    Attributes:
        steps: all that was told, oldest first.
        hands: by side, when a hand's pose arrived last, and where it is.
        seen_hands: by side, when the LIDAR's points on a hand arrived last, and which.
        sensor_off_m: (3,) how far clouds show things from where they are, as was learnt at the hand.
        parts: of the footstep plan that is being shown, by number.
        laid: how many states had been visited, and steps been told, when a template was last laid; None: never was.
        checked: by request, what somebody who was asked to look found off: ``template``, ``hand``, ``sensor`` (it,
            as clouds are) or nothing (empty); ``world``: the world model was reset before the answer.
        chosen: by state, how often each of its outcomes was chosen.
        done: by request, whether what was done by hand succeeded.
        last_by_hand: the state that was done by hand last.
        in_reach: the thing is within the hands' reach from the start, as the crew was told.
        ordered: names of the affordances that were ordered and of which nothing was told yet.
        reset: how many steps had been told when the world model was last reset.
        walks: how many states had been visited when the robot was last seen to have walked, oldest first.
        clouds, poses: how many clouds, and poses of hands, have arrived.

    """

    steps: tuple[Felt, ...] = ()
    hands: dict[str, tuple[float, HandPose]] = field(default_factory=dict)
    seen_hands: dict[str, tuple[float, HandCloud]] = field(default_factory=dict)
    sensor_off_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    parts: dict[int, FootstepPlan] = field(default_factory=dict)
    laid: tuple[int, int] | None = None
    checked: dict[int, str] = field(default_factory=dict)
    chosen: dict[str, dict[str, int]] = field(default_factory=dict)
    done: dict[int, bool] = field(default_factory=dict)
    last_by_hand: str = ""
    in_reach: bool = False
    ordered: tuple[str, ...] = ()
    reset: int = 0
    walks: tuple[int, ...] = ()
    clouds: int = 0
    poses: int = 0

    def take(self, message: Message, now_s: float, states: tuple[str, ...]) -> None:
        """Remember what a message says; ``states``: at work, as far as known."""
        match message:
            case StepDone():
                ordered, self.ordered = self.ordered[:1], self.ordered[1:]
                self.steps = (*self.steps, Felt(now_s, message, ordered[0] if ordered else " ".join(states)))
            case HandPose(side=side):
                self.hands[side], self.poses = (now_s, message), self.poses + 1
            case HandCloud(side=side):
                self.seen_hands[side] = now_s, message
            case FootstepPlan(part=part, parts=parts):
                if any(old.parts != parts or old.part == part for old in self.parts.values()):
                    self.parts = {}
                self.parts[part] = message
            case VoxelCloud():
                self.clouds += 1

    def note_order(self, order: TemplateStep, name: str) -> None:
        """Remember what was ordered, so that its outcome is known as such."""
        del order
        self.ordered = (*self.ordered, name)

    def note_laid(self, visited: int) -> None:
        """A template was laid, or found to lie right."""
        self.laid = visited, len(self.steps)

    def note_choice(self, state: str, event: str) -> None:
        """A decision was made."""
        counts = self.chosen.setdefault(state, {})
        counts[event] = counts.get(event, 0) + 1

    def choices(self, state: str, event: str) -> int:
        """How often an outcome was chosen."""
        return self.chosen.get(state, {}).get(event, 0)

    @property
    def last(self) -> Felt | None:
        """What was told last."""
        return self.steps[-1] if self.steps else None

    @property
    def since_laid(self) -> tuple[Felt, ...]:
        """Steps told since a template was laid."""
        return self.steps[self.laid[1] :] if self.laid is not None else self.steps

    def turned(self) -> float:
        """How far the thing was turned altogether [rad], as felt."""
        return sum(max(f.done.amount, 0.0) for f in self.steps if f.is_turn)

    def turned_now(self) -> float:
        """How far it was turned since the hand last came [rad]: what is let go springs back."""
        total = 0.0
        for felt in self.steps:
            if felt.done.step in ("pregrasp", "grasp", "release"):
                total = 0.0
            elif felt.is_turn:
                total = 0.0 if felt.done.outcome == "grip_lost" else total + max(felt.done.amount, 0.0)
        return total

    def no_plans(self) -> int:
        """How many of the last steps in a row found no way."""
        count = 0
        for felt in reversed(self.steps):
            if felt.done.outcome != "no_plan":
                break
            count += 1
        return count

    @property
    def doubts_world(self) -> bool:
        """Have steps found no way so often in a row that the world model may be wrong? Once a row."""
        row = self.no_plans()
        return row >= NO_PLANS and self.reset <= len(self.steps) - row

    def note_walk(self, visited: int) -> None:
        """The robot was seen to walk, when so many states had been visited."""
        self.walks = (*self.walks, visited + 1)

    def note_reset(self) -> None:
        """The world model is reset."""
        self.reset = len(self.steps)

    @property
    def walked_since(self) -> bool:
        """Has the robot walked since a template was laid?"""
        return self.laid is not None and any(walk > self.laid[0] for walk in self.walks)

    @property
    def stands_there(self) -> bool:
        """Is the thing in reach, from the start or because the robot has walked?"""
        return self.in_reach or bool(self.walks)

    @property
    def plan(self) -> tuple[FootstepPlan, ...]:
        """All parts of the plan that is shown, in order; empty while one is missing."""
        if not self.parts or len(self.parts) < next(iter(self.parts.values())).parts:
            return ()
        return tuple(self.parts[k] for k in sorted(self.parts))


def walks(machine: Machine, state: str, stayed_s: float) -> bool:
    """Has the robot walked in this state, that it was seen to be in for so long? One without steps is over at once."""
    return stayed_s > AT_ONCE_S and machine.leaf(state).program.startswith(WALKS)
