"""Work through an object template by hand: lay it, look at ghosts, order steps, judge what came of them, fall back.

The operator-only workflow of Romay et al., sections 6.2.1 and 6.2.3, and the lower layers of their section 6.1.1: what
a step has failed twice is done by Cartesian teleoperation, towards where a finer cloud shows that the hand belongs.

Each piece of work is a sum of cited elements (``layer_elements``); figures are in ``template_layer.toml``. Only what
has arrived counts: clouds, ``StepDone`` and ``HandPose``.

Not modelled: choosing among several grasps; ghosts that show that a pose is out of reach (the field site says so).
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

import numpy as np

from teleop_sim.channel.messages import (
    CartesianTarget,
    HandPose,
    Request,
    ResetWorld,
    Side,
    TemplateStep,
)
from teleop_sim.operators.alignment import alignment_s
from teleop_sim.operators.at_work import LOST
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.clouds import ask_s, newest_cloud, sight, template_offset_m
from teleop_sim.operators.deeds import Deed, Deeds, LayerName, Made, only
from teleop_sim.operators.guide import Check, Guide, load_guide
from teleop_sim.operators.handling import STEP_OF, WELL, Goal, Handling, handling
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.operators.verification import CRITERION
from teleop_sim.templates.poses import Pose, Triple, pose_of, rotation
from teleop_sim.templates.server import Entry

GOES = 8
"""Goes of one turn that each bring something before it counts as failed (assumed)."""
PUSH_M = 0.2
"""How far a hand goes that pushes a door ajar by hand (assumed: 12 degrees at 0.85 m, and some)."""
STANDS_STILL = 3
"""Movements in a row that bring nothing before a person gives up (assumed)."""


@dataclass(frozen=True)
class LayerFigures:
    """The figures of ``template_layer.toml``; see there."""

    deliberation: float
    preview_views: int
    menu_words: int
    outcome_words: int
    motion_s: float
    tolerance_m: float
    longest_m: float
    error: float
    arc_rad: float
    go_rad: float
    go_ghosts: int
    before_m: float
    moves: int
    tries: int
    rounds: int
    finer: float
    finest_mm: int


@cache
def load_layer() -> LayerFigures:
    """The figures of ``template_layer.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("template_layer.toml").read_text(encoding="utf-8")
    return LayerFigures(**{name: entry["value"] for name, entry in tomllib.loads(text).items()})


def layer_elements(timing: OperatorTiming, figures: LayerFigures) -> dict[str, float]:
    """Mean times of the pieces of a template command [s], deliberation in them.

    ``choose``: in the template's menu: prepare, open it, find and read the entry, take it. ``preview``: choose, then
    look at the ghost from several views, verify. ``order``: choose, prepare, point, click, verify. ``judge``: turn to
    the picture, search it, read what came of the step, verify.

    Source of the acts: Romay et al., section 6.2.1 and Figure 3b; of the times: the keystroke-level model, Cogulator.
    """
    click = timing.point_s + timing.click_s
    choose = timing.mental_s + click + timing.search_s + figures.menu_words * timing.read_per_word_s + click
    views = figures.preview_views * (click + timing.read_image_s())
    judge = timing.turn_s + timing.read_image_s() + timing.read_line_s(figures.outcome_words) + timing.verify_s
    pieces = {
        "choose": choose,
        "preview": choose + views + timing.verify_s,
        "order": choose + timing.mental_s + click + timing.verify_s,
        "judge": judge,
    }
    return {name: figures.deliberation * seconds for name, seconds in pieces.items()}


@dataclass
class TemplateLayer:
    """What people do through a template by hand (``desk.Hands``).

    Args:
        giver: lays the template; it has the server and knows which thing it is.
        timing: of the person, before expertise and spread.
        side: hand that works. hand: kind of hand, for the library's grasps.
        guide: which states people check, and do in lieu. criterion: of whoever looks.
        figures: of ``template_layer.toml``.

    """

    giver: TemplateGiver
    timing: OperatorTiming
    side: Side = "left"
    hand: str = "robotiq"
    guide: Guide = field(default_factory=load_guide)
    criterion: float = CRITERION
    figures: LayerFigures = field(default_factory=load_layer)

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
        return self._look(belief, request, rng, z) if what == "template" else self._look_at_hand(belief, request, z)

    def doing(self, belief: Belief, request: Request, rng: np.random.Generator) -> Deeds:
        """Do by hand what a state does: its goals, or, of a state that is a person's from the start, all there are."""
        state = belief.path_of(request)
        goals = self._whole(self.guide.goals(belief.machine, state)) or self.thing.goals
        round_no, k = 0, 0
        while k < len(goals):
            if (yield from self._goal(belief, goals[k], rng)):
                k += 1
                continue
            round_no += 1
            if round_no >= self.figures.rounds:
                return False
            k = goals.index("pregrasp") if "pregrasp" in goals[:k] else k
            yield from self._align(belief, rng, tries=round_no)
        return True

    def _whole(self, goals: tuple[str, ...]) -> tuple[str, ...]:
        """A thing that is held is held by closed fingers, whether or not a behaviour has a state for them."""
        closes = goals[-1:] == ("grasp",) and "close" in self.thing.goals
        return (*goals, "close") if closes else goals

    # Goals ---------------------------------------------------------------------------------------------------------

    def _goal(self, belief: Belief, goal: str, rng: np.random.Generator) -> Deeds:
        if goal == "align":
            return (yield from self._align(belief, rng))
        if goal.startswith("preview"):
            yield Deed("template", f"ghost of the {goal.split()[1]}", self._pieces["preview"], only())
            return True
        if self.giver.lying() is None and not (yield from self._align(belief, rng)):
            return False
        if goal == "stand":
            return (yield from self._stand(belief, rng))
        if goal == "adjust":
            return (yield from self._by_eye(belief, goal, rng))
        fails = 0
        while True:
            if (yield from self._order(belief, goal)):
                return True
            fails += 1
            if belief.work.doubts_world:
                yield Deed("", "the world model may be wrong", self.timing.notice_s(), only(ResetWorld()))
            if fails >= self.figures.tries:
                return (yield from self._by_eye(belief, goal, rng))
            if not (yield from self._regain(belief, goal, rng)):
                return False

    def _stand(self, belief: Belief, rng: np.random.Generator) -> Deeds:
        """Walk to where the thing is in reach, if it is not, and lay the template anew from there."""
        if belief.work.stands_there:
            return True
        if not (yield from self._order(belief, "stand")):
            return False
        belief.work.note_walk(len(belief.visited))
        return (yield from self._align(belief, rng))

    def _regain(self, belief: Belief, goal: str, rng: np.random.Generator) -> Deeds:
        """Bring everything to where the goal can be tried again: the template laid anew, the hand before or at it."""
        last = belief.work.last
        if last is None or last.done.outcome not in LOST or goal in ("open", "close"):
            return True
        yield from self._align(belief, rng)
        hand: tuple[Goal, ...] = ("pregrasp", "open", "grasp", "close")
        before = hand[: hand.index("grasp")] if goal == "grasp" else hand if goal in ("turn", "push") else ()
        goals = [g for g in before if g in self.thing.goals]
        if goal == "push":
            goals.append("turn")
        for one in goals:
            if not (yield from self._order(belief, one)):
                return one in ("open", "close")
        return True

    def _order(self, belief: Belief, goal: str) -> Deeds:
        """Order a step, wait, judge; of a turn as many goes as bring something."""
        for _ in range(GOES):
            order, name = self._step(belief, goal)
            for _ in range(self.figures.go_ghosts if goal == "turn" and self.thing.adds else 0):
                yield Deed("template", f"ghost of {name}", self._pieces["preview"], only())

            def made(_now_s: float, order: TemplateStep = order, name: str = name) -> Made:
                belief.work.note_order(order, name)
                return Made((order,))

            text = f"order {name}"
            came = yield Deed("template", text, self._pieces["order"], made, "step", self.figures.motion_s)
            yield Deed(
                "template", f"judge {name}" if came else f"nothing came of {name}", self._pieces["judge"], only()
            )
            if not came:
                belief.work.ordered = ()
                return False
            if self._achieved(belief, goal):
                return True
            last = belief.work.last
            lost = last is None or last.done.outcome in LOST
            if goal != "turn" or lost or abs(last.done.amount if last is not None else 0.0) < self.figures.arc_rad:
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

    # Templates and clouds ------------------------------------------------------------------------------------------

    def _fetch(self, belief: Belief, tries: int = 0) -> Deeds:
        """A fresh cloud of where the thing is."""
        region, lying = self.giver.region, self.giver.lying()
        if region is None:
            return newest_cloud(belief) is not None
        middle = None if lying is None else _handle(self.giver, lying.pose)
        ask = Deed("", "ask for a cloud", ask_s(self.timing), only(region.ask(middle, tries)), "cloud")
        for _ in range(self.figures.rounds):
            if (yield ask):
                return True
        return False

    def _align(self, belief: Belief, rng: np.random.Generator, tries: int = 0) -> Deeds:
        """Lay the template over a cloud of now."""
        for k in range(self.figures.rounds):
            cloud = newest_cloud(belief) if self.giver.lying() is None and not k else None
            if cloud is None and not (yield from self._fetch(belief, tries + k)):
                return False
            again, before = self.giver.lying() is not None, self.giver.laid
            voxel_m = cloud.voxel_m if cloud is not None else _voxel_m(belief)
            work_s = alignment_s(self.timing, self.giver.figures, voxel_m, again)

            def made(now_s: float) -> Made:
                told = self.giver.lay(belief, now_s, rng)
                if told is not None:
                    belief.work.note_laid(len(belief.visited))
                return Made((told,) if told is not None else ())

            yield Deed("alignment", "lay the template anew" if again else "lay the template", work_s, made)
            if self.giver.fits and self.giver.laid is not before:
                return True
        return False

    def _look(self, belief: Belief, request: Request, rng: np.random.Generator, z: float) -> Deeds:
        """Compare the template that lies with a cloud of now, and lay it anew if it is found off."""
        lying = self.giver.lying()
        if lying is None or not (yield from self._fetch(belief)):
            return True
        pose, event, off = lying.pose, _event(belief, request), list[bool]()

        def made(now_s: float) -> Made:
            cloud, fitted = newest_cloud(belief), self.giver.fitted(belief, pose, rng)
            if cloud is None or fitted is None:
                return Made()
            offset_m = template_offset_m(self.giver.template, pose, fitted)
            seen = sight("template", offset_m, cloud, self.giver.figures, self.criterion, z)
            off.append(seen.off)
            return Made((), (seen.record(now_s, request.request, event),))

        timing = self.timing
        yield Deed(
            "alignment", "compare template and cloud", timing.turn_s + timing.read_image_s() + timing.verify_s, made
        )
        if not any(off):
            belief.work.note_laid(len(belief.visited))
            return True
        belief.work.checked[request.request] = "template"
        work_s = alignment_s(timing, self.giver.figures, _voxel_m(belief), again=True)

        def moved(now_s: float) -> Made:
            told = self.giver.lay(belief, now_s, rng)
            belief.work.note_laid(len(belief.visited))
            return Made((told,) if told is not None else ())

        yield Deed("alignment", "lay the template anew", work_s, moved)
        return False

    def _look_at_hand(self, belief: Belief, request: Request, z: float) -> Deeds:
        """Compare where the hand is with where the template says that it belongs."""
        lying, cloud, event = self.giver.lying(), newest_cloud(belief), _event(belief, request)
        hand = self._hand(belief)
        if lying is None or cloud is None or hand is None:
            return True
        place = self.thing.place(lying.pose, hand.position_m)
        offset_m = math.dist(place, hand.position_m)
        seen = sight("hand", offset_m, cloud, self.giver.figures, self.criterion, z)

        def made(now_s: float) -> Made:
            return Made((), (seen.record(now_s, request.request, event),))

        timing = self.timing
        yield Deed("", "look at the hand", timing.turn_s + timing.read_image_s() + timing.verify_s, made)
        if seen.off:
            belief.work.checked[request.request] = "hand"
        return not seen.off

    # By eye --------------------------------------------------------------------------------------------------------

    def _by_eye(self, belief: Belief, goal: str, rng: np.random.Generator) -> Deeds:
        """Move the hand itself, towards where a finer cloud shows the thing."""
        if goal in ("open", "close") or self._hand(belief) is None:
            return False
        if goal != "adjust":
            yield from self._align(belief, rng, tries=1)
        lying = self.giver.lying()
        if lying is None:
            return False
        if goal == "turn":
            return (yield from self._arc(belief, lying.pose, rng))
        hand = self._hand(belief)
        assert hand is not None
        into = lying.pose.matrix[:, 0]
        if goal == "push":
            target = np.array(hand.position_m) + PUSH_M * into
        else:
            back = self.figures.before_m if goal == "pregrasp" else 0.0
            target = np.array(self.thing.place(lying.pose, hand.position_m)) - back * into
        return (yield from self._straight(belief, target, rng))

    def _straight(self, belief: Belief, target: np.ndarray, rng: np.random.Generator) -> Deeds:
        still = 0
        for _ in range(self.figures.moves):
            hand = self._hand(belief)
            assert hand is not None
            left = target - np.array(hand.position_m)
            away_m = float(np.linalg.norm(left))
            if away_m <= self.figures.tolerance_m:
                return True
            wanted = left * min(1.0, self.figures.longest_m / away_m)
            off = self.figures.error * float(np.linalg.norm(wanted)) * rng.standard_normal(3)
            place = _triple(np.array(hand.position_m) + wanted + off)
            came = yield self._nudge(CartesianTarget(self.side, place, hand.rotation_rad))
            now = self._hand(belief)
            closer = now is not None and away_m - float(np.linalg.norm(target - np.array(now.position_m)))
            still = 0 if came and closer > self.figures.tolerance_m / 2 else still + 1
            if still >= STANDS_STILL:
                return False
        return False

    def _arc(self, belief: Belief, pose: Pose, rng: np.random.Generator) -> Deeds:
        """Round the axis in small turns, until the hand has gone far enough round it."""
        affordance = self.giver.template.affordance(self.thing.affordances["turn"])
        axis, origin = (np.array(v) for v in affordance.at(pose))
        way = math.copysign(self.figures.arc_rad, affordance.amount)
        gone, still, start = 0.0, 0, belief.work.turned() if self.thing.adds else 0.0
        for _ in range(4 * self.figures.moves):
            hand = self._hand(belief)
            assert hand is not None
            if start + gone >= self.thing.enough["turn"]:
                return True
            turn = rotation(way * axis)
            arm = np.array(hand.position_m) - origin
            off = self.figures.error * self.figures.tolerance_m * rng.standard_normal(3)
            next_pose = pose_of(origin + turn @ arm + off, turn @ rotation(hand.rotation_rad))
            yield self._nudge(CartesianTarget(self.side, next_pose.position_m, next_pose.rotation_rad))
            now = self._hand(belief)
            step = abs(_angle(axis, arm, np.array(now.position_m) - origin)) if now is not None else 0.0
            gone, still = gone + step, 0 if step > abs(way) / 4 else still + 1
            if still >= STANDS_STILL:
                return False
        return False

    def _nudge(self, target: CartesianTarget) -> Deed:
        work_s = self.timing.approach_s() + self.timing.command_s()
        return Deed("teleoperation", "move the hand", work_s, only(target), "hand", self.figures.motion_s)

    def _hand(self, belief: Belief) -> HandPose | None:
        found = belief.work.hands.get(self.side)
        return None if found is None else found[1]

    @property
    def _pieces(self) -> dict[str, float]:
        return layer_elements(self.timing, self.figures)


def layer_of(deed: Deed) -> LayerName:
    """The layer of control that a deed belongs to."""
    return deed.layer


def _handle(giver: TemplateGiver, pose: Pose) -> Triple:
    return _triple(pose.place(np.array(giver.template.handle_m)))


def _voxel_m(belief: Belief) -> float:
    cloud = newest_cloud(belief)
    return cloud.voxel_m if cloud is not None else 0.0


def _event(belief: Belief, request: Request) -> str:
    return belief.machine.table[request.edge].event if request.edge >= 0 else ""


def _angle(axis: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """From (3,) to (3,) about an axis [rad]."""
    a, b = a - axis * float(axis @ a), b - axis * float(axis @ b)
    return math.atan2(float(axis @ np.cross(a, b)), float(a @ b))


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(v) for v in values)
    return x, y, z


__all__ = ["Entry", "LayerFigures", "TemplateLayer", "layer_elements", "load_layer"]
