"""Work through an object template by hand: lay it, look at ghosts, order steps, judge what came of them, fall back.

The operator-only workflow of Romay et al., sections 6.2.1 and 6.2.3, and the lower layers of their section 6.1.1: what
a step has failed twice is done by Cartesian teleoperation, towards where a finer cloud shows that the hand belongs.

Each piece of work is a sum of cited elements (``layer_elements``); figures are in ``template_layer.toml``. Only what
has arrived counts: clouds, ``StepDone`` and ``HandPose``.

Not modelled: choosing among several grasps; ghosts that show that a pose is out of reach (the field site says so).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from teleop_sim.channel.messages import Request, ResetWorld, Side, TemplateStep
from teleop_sim.operators.at_work import LOST
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.by_eye import HandByEye
from teleop_sim.operators.clouds import newest_cloud
from teleop_sim.operators.deeds import Deed, Deeds, Made, only
from teleop_sim.operators.guide import Check, Guide, load_guide
from teleop_sim.operators.handling import STEP_OF, WELL, Goal, Handling, handling
from teleop_sim.operators.layer_figures import LayerFigures, layer_elements, load_layer
from teleop_sim.operators.laying import Laying
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.operators.verification import CRITERION

GOES = 8
"""Goes of one turn that each bring something before it counts as failed (assumed)."""


@dataclass
class TemplateLayer:
    """What people do through a template by hand (``desk.Hands``).

    Args:
        giver: lays the template; it has the server and knows which thing it is.
        timing: of the person, before expertise and spread.
        side: hand that works. hand: kind of hand, for the library's grasps.
        guide: which states people check, and do in lieu. criterion: of whoever looks.
        figures: of ``template_layer.toml``.
        watched: somebody else watches the robot move and says what came of it. Whoever works has the time of a movement
            for what comes next; one person alone watches, because attention serves one thing at a time.

    """

    giver: TemplateGiver
    timing: OperatorTiming
    side: Side = "left"
    hand: str = "robotiq"
    guide: Guide = field(default_factory=load_guide)
    criterion: float = CRITERION
    figures: LayerFigures = field(default_factory=load_layer)
    watched: bool = False
    _chosen: bool = field(default=False, init=False)
    _previewed: frozenset[str] = field(default=frozenset(), init=False)
    _looked: bool = field(default=False, init=False)

    @property
    def thing(self) -> Handling:
        """How the thing is dealt with."""
        return handling(self.giver.template.name)

    # What is to be done --------------------------------------------------------------------------------------------

    def check(self, belief: Belief, request: Request) -> Check:
        """What somebody is to look at before a request is answered; empty: nothing can have changed."""
        wanted = self.guide.check(belief, request)
        lying = self.giver.lying()
        if not wanted or lying is None:
            return ""
        if wanted == "hand":
            return wanted if self.side in belief.work.hands and newest_cloud(belief) is not None else ""
        work = belief.work
        turned = self.thing.adds and any(felt.is_turn for felt in work.since_laid)
        failed = any(felt.done.outcome in LOST for felt in work.since_laid)
        return wanted if turned or failed or work.walked_since else ""

    def checking(self, belief: Belief, request: Request, what: Check, rng: np.random.Generator) -> Deeds:
        """Look whether the template, or the hand at it, is where it should be; the template is moved if not."""
        z = float(rng.standard_normal())
        if what == "template":
            return self._laying.look(belief, request, rng, z)
        self._looked = True
        return self._laying.look_at_hand(belief, request, self.side, rng, z)

    def doing(self, belief: Belief, request: Request, rng: np.random.Generator) -> Deeds:
        """Do by hand what a state does: its goals, or, of a state that is a person's from the start, all there are."""
        state = belief.path_of(request)
        goals = self._whole(self.guide.goals(belief.machine, state)) or self.thing.goals
        round_no, k = 0, 0
        while k < len(goals):
            if (yield from self._goal(belief, request, goals[k], rng)):
                k += 1
                continue
            round_no += 1
            if round_no >= self.figures.rounds:
                return False
            k = goals.index("pregrasp") if "pregrasp" in goals[:k] else k
            yield from self._laying.align(belief, rng, tries=round_no)
        return True

    def _whole(self, goals: tuple[str, ...]) -> tuple[str, ...]:
        """A thing that is held is held by closed fingers, whether or not a behaviour has a state for them."""
        closes = goals[-1:] == ("grasp",) and "close" in self.thing.goals
        return (*goals, "close") if closes else goals

    # Goals ---------------------------------------------------------------------------------------------------------

    def _goal(self, belief: Belief, request: Request, goal: str, rng: np.random.Generator) -> Deeds:
        if goal == "align":
            return (yield from self._laying.align(belief, rng))
        if goal.startswith("preview"):
            if goal not in self._previewed:
                yield self._ghost(goal)
            return True
        if self.giver.lying() is None and not (yield from self._laying.align(belief, rng)):
            return False
        if goal == "stand":
            return (yield from self._stand(belief, request, rng))
        if goal == "adjust":
            return (yield from self._by_eye(belief, goal, rng))
        fails = 0
        while True:
            well = yield from self._order(belief, goal)
            if goal == "grasp" and not self._looked:
                self._looked, known, z = True, belief.work.sensor_off_m, float(rng.standard_normal())
                yield from self._laying.look_at_hand(belief, request, self.side, rng, z)
                if belief.work.sensor_off_m != known:
                    yield from self._before(belief, goal)
                    continue
            if well:
                return True
            fails += 1
            if belief.work.doubts_world:
                yield Deed("", "the world model may be wrong", self.timing.notice_s(), only(ResetWorld()))
            if fails >= self.figures.tries:
                return (yield from self._by_eye(belief, goal, rng))
            if not (yield from self._regain(belief, goal, rng)):
                return False

    def _stand(self, belief: Belief, request: Request, rng: np.random.Generator) -> Deeds:
        """Walk to where the thing is in reach, if it is not, and look from there whether the template still fits.

        In a team somebody else sees to the footsteps, of which more than ten had to be put by hand (Romay et al.,
        section 6.1.2); whoever works looks at the ghosts meanwhile, which do not depend on where the robot stands.
        """
        if belief.work.stands_there:
            return True
        for goal in [g for g in self.thing.goals if g.startswith("preview")] if self.watched else []:
            yield self._ghost(goal)
            self._previewed |= {goal}
        if not (yield from self._order(belief, "stand")):
            return False
        belief.work.note_walk(len(belief.visited))
        yield from self._laying.look(belief, request, rng, float(rng.standard_normal()))
        return True

    def _regain(self, belief: Belief, goal: str, rng: np.random.Generator) -> Deeds:
        """Bring everything to where the goal can be tried again: the template laid anew, the hand before or at it."""
        last = belief.work.last
        if last is None or last.done.outcome not in LOST or goal in ("open", "close"):
            return True
        yield from self._laying.align(belief, rng)
        return (yield from self._before(belief, goal))

    def _before(self, belief: Belief, goal: str) -> Deeds:
        """Bring the hand to where a goal starts."""
        hand: tuple[Goal, ...] = ("pregrasp", "open", "grasp", "close")
        before = hand[: hand.index("grasp")] if goal == "grasp" else hand if goal in ("turn", "push") else ()
        goals = [g for g in before if g in self.thing.goals]
        if goal == "push":
            goals.append("turn")
        for one in goals:
            if not (yield from self._order(belief, one)):
                return one in ("open", "close")
        return True

    def _ghost(self, goal: str) -> Deed:
        return Deed("template", f"ghost of the {goal.split()[1]}", self._pieces["preview"], only())

    def _order(self, belief: Belief, goal: str) -> Deeds:
        """Order a step, wait, judge; of a turn as many goes as bring something.

        Who is relieved of watching chooses meanwhile what comes next.
        """
        next_one = Deed("template", "choose what comes next", self._pieces["choose"], only())
        meanwhile = (next_one,) if self.watched else ()
        for _ in range(GOES):
            order, name = self._step(belief, goal)
            spared_s = self._pieces["choose"] if self._chosen else 0.0
            for _ in range(self.figures.go_ghosts if goal == "turn" and self.thing.adds else 0):
                yield Deed("template", f"ghost of {name}", self._pieces["preview"] - spared_s, only())

            def made(_now_s: float, order: TemplateStep = order, name: str = name) -> Made:
                belief.work.note_order(order, name)
                return Made((order,))

            text = f"order {name}"
            order_s = self._pieces["order"] - spared_s
            came = yield Deed("template", text, order_s, made, "step", self.figures.motion_s, meanwhile)
            yield Deed(
                "template", f"judge {name}" if came else f"nothing came of {name}", self._pieces["judge"], only()
            )
            self._chosen = self.watched and came and not self._failed(belief)
            if not came:
                belief.work.ordered = ()
                return False
            if self._achieved(belief, goal):
                return True
            last = belief.work.last
            went = 0.0 if last is None else abs(last.done.amount)
            if goal != "turn" or self._failed(belief) or went < self.figures.arc_rad:
                return False
        return False

    def _step(self, belief: Belief, goal: str) -> tuple[TemplateStep, str]:
        template, lying, step = self.giver.template, self.giver.lying(), STEP_OF[goal]
        instance = lying.instance if lying is not None else 0
        if step != "affordance":
            grasps = template.grasps_of(self.hand, self.side)
            which = grasps[0].id if grasps and goal in ("pregrasp", "grasp") else 0
            return TemplateStep(step, instance, self.side, which), goal
        affordance = template.affordance(self.thing.affordances[goal])
        amount = 0.0
        if self.thing.adds:
            left = max(self.thing.enough[goal] - belief.work.turned(), 0.0)
            amount = min(left + self.figures.arc_rad, self.figures.go_rad)
        return TemplateStep(step, instance, self.side, affordance.id, amount), affordance.name

    def _failed(self, belief: Belief) -> bool:
        last = belief.work.last
        return last is None or last.done.outcome in LOST

    def _achieved(self, belief: Belief, goal: str) -> bool:
        last = belief.work.last
        if last is None:
            return False
        if goal == "turn":
            done = belief.work.turned() if self.thing.adds else belief.work.turned_now()
            return done >= self.thing.enough[goal]
        if goal == "push":
            return abs(last.done.amount) >= self.thing.enough[goal]
        return last.done.outcome in WELL

    def _by_eye(self, belief: Belief, goal: str, rng: np.random.Generator) -> Deeds:
        """Move the hand itself, towards where a finer cloud shows the thing."""
        eye = HandByEye(self.giver.template, self.thing, self.side, self.timing, self.figures)
        if goal not in ("pregrasp", "grasp", "turn", "push", "adjust") or eye.hand(belief) is None:
            return False
        if goal != "adjust":
            yield from self._laying.align(belief, rng, tries=1)
        lying = self.giver.lying()
        return lying is not None and (yield from eye.reach(belief, goal, lying.pose, rng))

    @property
    def _laying(self) -> Laying:
        return Laying(self.giver, self.timing, self.figures, self.criterion)

    @property
    def _pieces(self) -> dict[str, float]:
        return layer_elements(self.timing, self.figures, self.watched)
