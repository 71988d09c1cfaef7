"""Laying a template and looking whether it, or the hand at it, is right: with clouds that are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import Request, Side
from teleop_sim.operators.alignment import alignment_s
from teleop_sim.operators.at_work import AtWork
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.clouds import ask_s, eye_m, hand_blur_m, newest_cloud, sight, template_offset_m
from teleop_sim.operators.deeds import Deed, Deeds, Made, only
from teleop_sim.operators.handling import handling
from teleop_sim.operators.layer_figures import LayerFigures
from teleop_sim.operators.template_giver import TemplateGiver
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.poses import Pose, Triple

SHOWS_SD = 3.0
"""Evidence above which somebody whose hand is off takes clouds for off, too (assumed: half the criterion, as it tells
why)."""


@dataclass(frozen=True)
class Laying:
    """Of one template.

    Attributes:
        giver: lays it. timing: of the person. figures: how often something is tried.
        criterion: evidence above which something is found off.

    """

    giver: TemplateGiver
    timing: OperatorTiming
    figures: LayerFigures
    criterion: float

    def fetch(self, belief: Belief, tries: int = 0) -> Deeds:
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

    def align(self, belief: Belief, rng: np.random.Generator, tries: int = 0) -> Deeds:
        """Lay the template over a cloud of now."""
        for k in range(self.figures.rounds):
            cloud = newest_cloud(belief) if self.giver.lying() is None and not k else None
            if cloud is None and not (yield from self.fetch(belief, tries + k)):
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

    def look(self, belief: Belief, request: Request, rng: np.random.Generator, z: float) -> Deeds:
        """Compare the template that lies with a cloud of now, and lay it anew if it is found off."""
        lying = self.giver.lying()
        if lying is None or not (yield from self.fetch(belief)):
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

    def look_at_hand(self, belief: Belief, request: Request, side: Side, rng: np.random.Generator, z: float) -> Deeds:
        """Compare where the hand is with where the template says that it belongs, in a cloud of now.

        The cloud shows the hand, too: where it is seen beside where the joints have it, everything else is. What is
        found off so is remembered, and the template moved to where the hand then goes to the thing.
        """
        lying, work, event = self.giver.lying(), belief.work, _event(belief, request)
        if lying is None or side not in work.hands:
            return True
        if not _seen_since(work, side):
            yield from self.fetch(belief)
        cloud, hand = newest_cloud(belief), work.hands[side][1]
        if cloud is None:
            return True
        shown = work.seen_hands[side][1] if _seen_since(work, side) else None
        aside = np.zeros(3) if shown is None else np.array(shown.offset_m()) - work.sensor_off_m
        belongs = handling(self.giver.template.name).place(lying.pose, hand.position_m)
        offset_m = float(np.linalg.norm(hand.position_m + aside - np.array(belongs)))
        blur_m = 0.0 if shown is None else hand_blur_m(shown)
        seen = sight("hand", offset_m, cloud, self.giver.figures, self.criterion, z, blur_m)

        def made(now_s: float) -> Made:
            return Made((), (seen.record(now_s, request.request, event),))

        timing = self.timing
        yield Deed("", "look at the hand", timing.turn_s + timing.read_image_s() + timing.verify_s, made)
        if not seen.off:
            return True
        work.checked[request.request] = "hand"
        if float(np.linalg.norm(aside)) / seen.sigma_m + z > SHOWS_SD:
            work.checked[request.request] = "sensor"
            # By hand, and by eye.
            yield self._moving(belief, aside + eye_m(self.giver.figures, cloud.voxel_m) * rng.standard_normal(3))
        return False

    def _moving(self, belief: Belief, aside: np.ndarray) -> Deed:
        """Move the template by what clouds are off beyond what was known."""
        x, y, z = (float(v) for v in aside)

        def moved(now_s: float) -> Made:
            told, (ox, oy, oz) = self.giver.shift((-x, -y, -z), now_s), belief.work.sensor_off_m
            belief.work.sensor_off_m = (ox + x, oy + y, oz + z)
            belief.work.note_laid(len(belief.visited))
            return Made((told,) if told is not None else ())

        work_s = alignment_s(self.timing, self.giver.figures, _voxel_m(belief), again=True)
        return Deed("alignment", "move the template by what the hand shows", work_s, moved)


def _seen_since(work: AtWork, side: Side) -> bool:
    """Has a cloud of the hand come since it was last told where it is?"""
    return side in work.seen_hands and work.seen_hands[side][0] > work.hands[side][0]


def _handle(giver: TemplateGiver, pose: Pose) -> Triple:
    x, y, z = (float(v) for v in pose.place(np.array(giver.template.handle_m)))
    return x, y, z


def _voxel_m(belief: Belief) -> float:
    cloud = newest_cloud(belief)
    return cloud.voxel_m if cloud is not None else 0.0


def _event(belief: Belief, request: Request) -> str:
    return belief.machine.table[request.edge].event if request.edge >= 0 else ""
