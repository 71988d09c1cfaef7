"""ViGIR's way: the behaviour works, people decide where it asks, look where it may be wrong, and act where it fails.

``Supervise``, the table of decisions (``guide.py``) and ``StepDown``'s fall-back: a state that failed twice in a row,
or once where somebody had to step in before, is done by hand through templates or, failing that, by moving the hand
(``template_layer.py``); its outcome is then forced.

Source: A. Romay et al., sections 5.2 and 6.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from teleop_sim.channel.messages import (
    Confirm,
    Force,
    HandBack,
    Message,
    Reject,
    Request,
    ResetWorld,
    SetLevel,
    TakeOver,
)
from teleop_sim.machines.declare import Edge
from teleop_sim.operators.acts import Briefing
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.guide import Guide, ends_all, load_guide, world_first
from teleop_sim.operators.step_down import StepDown

LATELY = 6
"""States back, at most, from what carries a plan out to what made it: goal, plan, look, container, walk (counted)."""


@dataclass(frozen=True)
class Collaborate(StepDown):
    """As above.

    Attributes:
        guide: the table.
        level_there: level that the supervisor sets once the robot has come to the thing; None: the level stays. On day
            two of the Finals ViGIR's went to High there (Romay et al., section 6.1.4).

    """

    guide: Guide = field(default_factory=load_guide)
    level_there: int | None = None

    def answer(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        """What the table says; of a failure another try, then ``TakeOver``; else as ``Supervise``."""
        if request.kind == "act":
            return self._acted(belief, request)
        chosen = self.guide.answer(belief, request)
        if chosen:
            return chosen
        if request.kind == "confirm" and request.edge >= 0:
            edge = belief.machine.table[request.edge]
            if edge.kind == "failed":
                return self._failing(belief, request, edge)
        # Not StepDown's: what it takes over goes by the table here.
        return super(StepDown, self).answer(belief, request)

    def advise(self, belief: Belief, now_s: float, briefing: Briefing, /) -> tuple[Message, ...]:
        """``SetLevel`` once the robot has come to the thing; ``ResetWorld`` when steps repeatedly find no way."""
        del now_s, briefing
        if self.level_there is not None and belief.work.walks and SetLevel.topic not in belief.sent:
            return (SetLevel(self.level_there),)
        # Who acts by hand sees to it himself; before some answers it is seen to anyhow.
        seen_to = any(asked.kind == "act" or world_first(belief, asked) for asked in belief.mirror.asked)
        return (ResetWorld(),) if belief.work.doubts_world and not seen_to else ()

    def wake_s(self, _belief: Belief, _now_s: float, _briefing: Briefing, /) -> float:
        """Never: advice depends on what arrives."""
        return math.inf

    def stale_s(self, _request: Request, /) -> float:
        """Nothing: who acts by hand asks for what he needs (``template_layer.py``)."""
        return math.inf

    def _acted(self, belief: Belief, request: Request) -> tuple[Message, ...]:
        state = belief.path_of(request)
        event = self.guide.done_event(belief.machine, state)
        if belief.work.done.get(request.request) and event:
            return (Force(belief.machine.edge_index(state, event), belief.mirror.seen),)
        failed = next((e.event for e in belief.machine.outcomes_of(state) if e.kind == "failed"), "")
        if failed and not self.guide.goals(belief.machine, state):
            # The state was a person's from the start: nobody else can go on with it.
            return (Force(belief.machine.edge_index(state, failed), belief.mirror.seen),)
        return (HandBack(request.request),)

    def _failing(self, belief: Belief, request: Request, edge: Edge) -> tuple[Message, ...]:
        """Of a state that was just done by hand: its success; else a new try; else by hand; else let it fail.

        In a world model that is new a failure says nothing yet: another try, however often it has failed.
        """
        state, machine = edge.state, belief.machine
        done = next((e.event for e in machine.outcomes_of(state) if e.kind == "done"), "")
        if done and belief.work.last_by_hand in belief.visited[-LATELY:-1] and _executes(belief, state):
            return (Force(machine.edge_index(state, done), belief.mirror.seen),)
        if belief.work.checked.get(request.request) == "world":
            return (Reject(request.request),)
        fails = belief.failed.get(state, 0) + belief.refused.get(request.edge, 0) + 1
        able = bool(self.guide.goals(machine, state)) and not belief.in_lieu.get(state, 0)
        # Who had to step in once steps in at once.
        after = 1 if belief.in_lieu else self.after
        if fails >= after and able:
            return (TakeOver(request.node),)
        if fails < self.after and ends_all(machine, edge):
            return (Reject(request.request),)
        return (Confirm(request.request),)


def _executes(belief: Belief, state: str) -> bool:
    """Does the state carry out what the one before it has planned? If that was done by hand, so was this."""
    return belief.machine.leaf(state).program.startswith("Execute")
