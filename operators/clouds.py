"""Clouds of a place: which is asked for, and what an eye makes of a template that is laid over one, or of a hand at it.

Signal detection as in ``verification.py``: evidence is d' plus a standard normal, d' the offset over what the eye can
tell at this size of voxels; above the person's criterion something is found off. Offsets are those of the best fit to
the cloud that arrived from where the template lies, or of the hand from where it should be: it is where the robot's own
joints have it, and so far aside as the LIDAR sees it from there, because in that frame templates are laid.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass

import numpy as np

from teleop_sim.channel.messages import AskCloud, HandCloud, VoxelCloud
from teleop_sim.core.records import Judged
from teleop_sim.operators.alignment import AlignmentFigures
from teleop_sim.operators.belief import Belief
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple

ARM_M = 0.1
"""How far from its handle a template's place is compared too, so that a turn shows (assumed: half a hand's width)."""


@dataclass(frozen=True)
class Region:
    """What is known beforehand of where a thing is, and which clouds people ask for.

    Attributes:
        expected_m: (3,) where it is expected, odometry frame.
        voxel_mm: edge of the voxels asked for first.
        radius_m: of the ball around the middle.
        finer: factor on the voxels when a cloud was not enough.
        finest_mm: not below this.

    """

    expected_m: Triple
    voxel_mm: int = 20
    radius_m: float = 0.6
    finer: float = 0.5
    finest_mm: int = 10

    def ask(self, middle_m: Triple | None = None, tries: int = 0) -> AskCloud:
        """For the cloud of the place, after so many that were not enough."""
        voxel_mm = max(min(self.finest_mm, self.voxel_mm), round(self.voxel_mm * self.finer**tries))
        return AskCloud(voxel_mm, self.expected_m if middle_m is None else middle_m, self.radius_m)


@dataclass(frozen=True)
class Sight:
    """What somebody made of an offset.

    Attributes:
        what: ``template`` or ``hand``.
        offset_m, sigma_m: how far off it is, and what an eye can tell.
        evidence: d' and the eye's noise [standard deviations]. criterion: of the person.
        unit_m: edge of the voxels it was seen in. picture: checksum of the cloud.

    """

    what: str
    offset_m: float
    sigma_m: float
    evidence: float
    criterion: float
    unit_m: float
    picture: int

    @property
    def off(self) -> bool:
        """Is it found off?"""
        return self.evidence > self.criterion

    def record(self, now_s: float, request: int, event: str) -> Judged:
        """For the log; lengths in voxels, which are such a cloud's pixels."""
        return Judged(
            now_s, request, event, self.picture, self.what, self.offset_m / self.unit_m, self.sigma_m / self.unit_m,
            self.offset_m / self.sigma_m, self.evidence, self.criterion, "rejected" if self.off else "accepted",
        )  # fmt: skip


def sight(
    what: str,
    offset_m: float,
    cloud: VoxelCloud,
    figures: AlignmentFigures,
    criterion: float,
    z: float,
    blur_m: float = 0.0,
) -> Sight:
    """Judge an offset that shows in a cloud; ``z``: a standard normal, the eye's noise. ``blur_m``: beside it."""
    sigma_m = math.hypot(eye_m(figures, cloud.voxel_m), blur_m)
    evidence = offset_m / sigma_m + z
    return Sight(what, offset_m, sigma_m, evidence, criterion, cloud.voxel_m, zlib.crc32(cloud.octree))


def eye_m(figures: AlignmentFigures, voxel_m: float) -> float:
    """What an eye can tell in voxels of a size, in each direction [m]."""
    return math.hypot(figures.residual_m, figures.residual_voxels * voxel_m)


def hand_blur_m(hand: HandCloud) -> float:
    """How well the middle of a hand's voxels is known, in each direction [m].

    An edge for each voxel, as noise of 1 cm fills neighbours, over the root of how many there are: 2.4 mm of Atlas'
    70 voxels of 2 cm, where 2.3 mm were measured.
    """
    return hand.voxels.voxel_m / math.sqrt(len(hand.voxels.centres_m()))


def template_offset_m(template: Template, lies: Pose, fits: Pose) -> float:
    """How far apart two layings of a template are at its handle, at most: there, and an arm's length across it [m]."""
    handle = np.array(template.handle_m)
    points = handle + ARM_M * np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return float(np.linalg.norm(lies.place(points) - fits.place(points), axis=1).max())


def newest_cloud(belief: Belief) -> VoxelCloud | None:
    """The cloud that arrived last."""
    _, view = belief.views.get(VoxelCloud.topic, (0.0, None))
    return view if isinstance(view, VoxelCloud) else None


def ask_s(timing: OperatorTiming) -> float:
    """Mean time to ask for the cloud of a place [s]: give a command and drag a box round the place."""
    return timing.command_s() + timing.point_s + timing.click_s
