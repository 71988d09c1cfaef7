"""Who asks for a template gets one: laid over the last cloud that arrived, told, and named in the answer.

FlexBE's input states ask the operator for ``SELECTED_OBJECT_ID`` (Romay et al., section 4.3 and Figure 16a). The
answer's data are the instance's number, one byte; the template itself goes ahead as ``TemplateInsert``, or as
``TemplateMove`` if one of its kind lies there already and is laid anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from teleop_sim.channel.messages import Answer, Message, Request, VoxelCloud
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.channel.template_messages import TemplateChange
from teleop_sim.operators.alignment import (
    LEAST_BORNE,
    Aligned,
    AlignmentFigures,
    alignment_s,
    disturbed,
    load_alignment,
)
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.clouds import Region, newest_cloud
from teleop_sim.operators.memo import FreshEyes
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple
from teleop_sim.templates.server import Entry

SELECTED_OBJECT = "SELECTED_OBJECT_ID"
"""What ViGIR's states ask for, as their parameter ``request`` says."""

STRAY_M = 0.25
"""A laying farther from where the thing is expected is of something else (assumed: twice what a first laying is off;
who sees the handle in the picture does not miss it by more)."""

STARTS = 3
"""So often somebody starts from there before another cloud is wanted (assumed)."""

LEAST_SHARE = 0.3
"""Of the points near a template that must lie on it for a person to think that it fits (assumed: a third)."""


@dataclass
class TemplateGiver:
    """Lays a template (``desk.Giver``).

    Args:
        station: the control station's server, which changes.
        template: that the person takes the thing for.
        eye_m: (3,) where the robot's sensor is believed to be, in the odometry frame.
        figures: of the person.
        region: where the thing is expected, and which clouds are asked for; None: nobody asks.
        eyes: how it is laid: worked out (default) or remembered.

    Attributes:
        laid: what was laid last; for reports of the station's own view.
        fits: whether it fitted.

    """

    station: StationTemplates
    template: Template
    eye_m: Triple
    figures: AlignmentFigures = field(default_factory=load_alignment)
    region: Region | None = None
    eyes: FreshEyes = field(default_factory=FreshEyes)
    laid: Aligned | None = None
    fits: bool = False
    _refused: VoxelCloud | None = None
    _tries: int = 0

    def wants(self, belief: Belief) -> Message | None:
        """What has to be asked for before a template can be laid: a cloud, finer each time one did not do."""
        cloud = newest_cloud(belief)
        if self.region is None or (cloud is not None and cloud is not self._refused):
            return None
        lying = self.lying()
        middle = None if lying is None else _point(lying.pose, self.template.handle_m)
        return self.region.ask(middle, self._tries)

    def work_s(self, belief: Belief, request: Request, timing: OperatorTiming) -> float:
        """Mean time that it takes [s]; without a cloud, that of looking for one."""
        del request
        cloud = newest_cloud(belief)
        if cloud is None:
            return timing.read_image_s()
        return alignment_s(timing, self.figures, cloud.voxel_m, again=self.lying() is not None)

    def give(self, belief: Belief, request: Request, rng: np.random.Generator) -> tuple[Message, ...]:
        """The template's message and the answer; nothing if no cloud has come, or the template fits none of it."""
        told = self.lay(belief, belief.heard_s, rng)
        return () if told is None else (told, Answer(request.request, bytes([told.instance])))

    def lay(self, belief: Belief, now_s: float, rng: np.random.Generator) -> TemplateChange | None:
        """Lay the template over the newest cloud, from where it lies if it does; None: no cloud, or it fits none."""
        cloud, lying = newest_cloud(belief), self.lying()
        self.fits = False
        if cloud is None:
            return None
        near = None if lying is None else lying.pose
        self.laid = self._align(belief, cloud, near, rng)
        for _ in range(STARTS):
            if self.laid is None or not self._strays(self.laid.pose):
                break
            # Map and picture show that the thing is elsewhere: the template is put there by hand first.
            start = self._where_expected(rng)
            self.laid = self._align(belief, cloud, start, rng)
        self.fits = self.laid is not None and self._right(self.laid)
        if self.laid is None or not self.fits:
            self._refused, self._tries = cloud, self._tries + 1
            return None
        pose = self.laid.pose
        if lying is None:
            return self.station.insert(self.template.type_id, pose, now_s)
        return self.station.move(lying.instance, pose, now_s)

    def fitted(self, belief: Belief, near: Pose, rng: np.random.Generator) -> Pose | None:
        """Where the newest cloud has the template, as well as it shows; None: it does not show it."""
        cloud = newest_cloud(belief)
        if cloud is None:
            return None
        found = self._align(belief, cloud, near, rng)
        return found.fit.pose if found is not None and self._right(found) else None

    def shift(self, by_m: Triple, now_s: float) -> TemplateChange | None:
        """Move the template that lies by (3,) [m]; None: there is none."""
        lying = self.lying()
        return None if lying is None else self.station.move(lying.instance, shifted(lying.pose, by_m), now_s)

    def _align(self, belief: Belief, cloud: VoxelCloud, near: Pose | None, rng: np.random.Generator) -> Aligned | None:
        """Lay it over a cloud, less what clouds are known to be off; ``near``: so, too."""
        off = belief.work.sensor_off_m
        start = None if near is None else shifted(near, off)
        found = self.eyes.align(self.template, cloud, self.eye_m, rng, self.figures, start)
        if found is None or not any(off):
            return found
        back = (-off[0], -off[1], -off[2])
        return Aligned(shifted(found.pose, back), replace(found.fit, pose=shifted(found.fit.pose, back)))

    def _right(self, laid: Aligned) -> bool:
        """Does a person think that it fits?"""
        shows = laid.fit.share >= LEAST_SHARE and laid.fit.borne >= LEAST_BORNE
        return shows and not self._strays(laid.pose)

    def _strays(self, pose: Pose) -> bool:
        """Is it so far from where the thing is expected that it must be something else?"""
        return self.region is not None and math.dist(pose.position_m, self.region.expected_m) > STRAY_M

    def _where_expected(self, rng: np.random.Generator) -> Pose:
        """The template put where map and picture have the thing, facing who looks, as exactly as a hand does."""
        assert self.region is not None
        place, eye = self.region.expected_m, self.eye_m
        facing = Pose(place, (0.0, 0.0, math.atan2(place[1] - eye[1], place[0] - eye[0])))
        shift, turn = rng.standard_normal((2, 3))
        return disturbed(self.template, facing, self.figures.coarse_m * shift, self.figures.coarse_rad * turn)

    def lying(self) -> Entry | None:
        """The newest instance of this template that lies in the odometry frame."""
        mine = [e for e in self.station.server.placed if (e.template, e.frame) == (self.template.type_id, "odometry")]
        return max(mine, key=lambda entry: entry.stamp, default=None)


def shifted(pose: Pose, by_m: Triple) -> Pose:
    """A pose moved by (3,) [m]."""
    (x, y, z), (dx, dy, dz) = pose.position_m, by_m
    return Pose((x + dx, y + dy, z + dz), pose.rotation_rad)


def _point(pose: Pose, point_m: Triple) -> Triple:
    x, y, z = (float(v) for v in pose.place(np.array(point_m)))
    return x, y, z
