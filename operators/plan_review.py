"""Who looks over a footstep plan, and who gives a goal to walk to.

FlexBE's input states ask for ``FOOTSTEP_PLAN_HEADER`` (the auxiliary operator confirms that a plan looks safe; an empty
answer takes it as it is) and for ``WAYPOINT_GOAL_POSE`` (six bytes: x, y, yaw as in ``FootstepGoal``). A plan too long
to be shown at once over a thin link comes in parts, each of which is looked at (Romay et al., sections 5.2 and 6.1.2).

Not modelled: a plan that is not sane; steps moved one by one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import Answer, FootstepGoal, Message, Request
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.timing import OperatorTiming

PLAN, GOAL = "FOOTSTEP_PLAN_HEADER", "WAYPOINT_GOAL_POSE"


@dataclass(frozen=True)
class PlanReviewer:
    """Looks at each part of a plan that has arrived, and takes it (``desk.Giver``)."""

    def work_s(self, belief: Belief, request: Request, timing: OperatorTiming) -> float:
        """Mean time [s]: find each part in the view, look at each step of it, verify the whole."""
        del request
        parts = belief.work.plan
        steps = sum(len(part.steps) for part in parts)
        return len(parts) * (timing.turn_s + timing.read_image_s()) + steps * timing.look_s + timing.verify_s

    def give(self, belief: Belief, request: Request, _rng: np.random.Generator) -> tuple[Message, ...]:
        """An empty answer; nothing while a part is missing."""
        if not belief.work.plan:
            return ()
        belief.work.parts = {}
        return (Answer(request.request, b""),)


@dataclass(frozen=True)
class GoalGiver:
    """Gives a goal before the thing, from where its template lies (``desk.Giver``).

    Attributes:
        giver: has the template. robot, side: whose stand pose of the template's is taken.

    """

    giver: TemplateGiver
    robot: str
    side: str = "left"

    def work_s(self, belief: Belief, request: Request, timing: OperatorTiming) -> float:
        """Mean time [s]: look at the place, think, put the feet there and turn them."""
        del belief, request
        return timing.read_image_s() + timing.think_s + 2.0 * (timing.point_s + timing.click_s) + timing.verify_s

    def give(self, _belief: Belief, request: Request, _rng: np.random.Generator) -> tuple[Message, ...]:
        """The goal; nothing without a template that lies there and has a stand."""
        lying = self.giver.lying()
        stands = [s for s in self.giver.template.stands if s.robot == self.robot]
        if lying is None or not stands:
            return ()
        stand = next((s for s in stands if s.side == self.side), stands[0])
        place = lying.pose.after(stand.pose)
        ahead = place.matrix[:, 0]
        goal = FootstepGoal(place.position_m[0], place.position_m[1], math.atan2(float(ahead[1]), float(ahead[0])))
        return (Answer(request.request, goal.encode()[1:]),)
