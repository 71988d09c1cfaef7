"""Who asks for a template gets one: laid over the last cloud that arrived, told, and named in the answer.

FlexBE's input states ask the operator for ``SELECTED_OBJECT_ID`` (Romay et al., section 4.3 and Figure 16a). The
answer's data are the instance's number, one byte; the template itself goes ahead as ``TemplateInsert``, or as
``TemplateMove`` if one of its kind lies there already and is laid anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from teleop_sim.channel.messages import Answer, Message, Request, VoxelCloud
from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.operators.alignment import Aligned, AlignmentFigures, align, alignment_s, load_alignment
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Triple
from teleop_sim.templates.server import Entry

SELECTED_OBJECT = "SELECTED_OBJECT_ID"
"""What ViGIR's states ask for, as their parameter ``request`` says."""

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

    Attributes:
        laid: what was laid last; for reports of the station's own view.

    """

    station: StationTemplates
    template: Template
    eye_m: Triple
    figures: AlignmentFigures = field(default_factory=load_alignment)
    laid: Aligned | None = None

    def work_s(self, belief: Belief, request: Request, timing: OperatorTiming) -> float:
        """Mean time that it takes [s]; without a cloud, that of looking for one."""
        del request
        cloud = self._cloud(belief)
        if cloud is None:
            return timing.read_image_s()
        return alignment_s(timing, self.figures, cloud.voxel_m, again=self._lying() is not None)

    def give(self, belief: Belief, request: Request, rng: np.random.Generator) -> tuple[Message, ...]:
        """The template's message and the answer; nothing if no cloud has come, or the template fits none of it."""
        cloud, lying = self._cloud(belief), self._lying()
        if cloud is None:
            return ()
        near = None if lying is None else lying.pose
        self.laid = align(self.template, cloud, self.eye_m, rng, self.figures, near)
        if self.laid is None or self.laid.fit.share < LEAST_SHARE:
            return ()
        now_s, pose = belief.heard_s, self.laid.pose
        if lying is None:
            told = self.station.insert(self.template.type_id, pose, now_s)
        else:
            told = self.station.move(lying.instance, pose, now_s)
        return told, Answer(request.request, bytes([told.instance]))

    def _cloud(self, belief: Belief) -> VoxelCloud | None:
        _, view = belief.views.get(VoxelCloud.topic, (0.0, None))
        return view if isinstance(view, VoxelCloud) else None

    def _lying(self) -> Entry | None:
        """The newest instance of this template that lies in the odometry frame."""
        mine = [e for e in self.station.server.placed if (e.template, e.frame) == (self.template.type_id, "odometry")]
        return max(mine, key=lambda entry: entry.stamp, default=None)
