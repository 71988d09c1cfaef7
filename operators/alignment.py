"""How a person lays a template over the cloud that has arrived: by eye, by fitting, and with what a person leaves.

The cloud is all that is known: where the thing really is plays no part. A coarser, older or emptier cloud gives a
poorer pose, and the grasp pays for it.

1. *Coarse*: the template's middle goes to the middle of the points, its face to where the cloud was seen from; of
   several headings the one that fits best. Then it is off as a hand's first placing is (``coarse_m``, ``coarse_rad``).
2. *Fit*: the best that this cloud supports, by least squares (``fitting.py``): what patient aligning would find.
3. *Residual*: what a person leaves of it: a little, and a share of a voxel.

Time: a sum of cited elements, one for each act (``alignment_elements``), spread as every sum is. Figures and their
sources are in ``alignment.toml`` and ``timing.toml``.

Not modelled: a person who gives up, takes a long time over a poor cloud, or picks another thing of the same shape.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from teleop_sim.channel.messages import VoxelCloud
from teleop_sim.operators.descent import Floats, Prepared
from teleop_sim.operators.fitting import LEAST_POINTS, Fit, fit_roughly, fit_template, prepared
from teleop_sim.operators.standoff import handle_of, laid_on_face
from teleop_sim.operators.timing import OperatorTiming
from teleop_sim.templates.elements import Template
from teleop_sim.templates.poses import Pose, Triple, pose_of, rotation

HEADINGS_RAD = (0.0, -0.5, 0.5)
"""About the vertical, from facing whoever looks (assumed: a thing that is worked on is looked at from before)."""

LEAST_BORNE = 0.5
"""Of a handle's surface that must show in the cloud for a person to think that a template fits (assumed: half)."""

CHOOSE_WORDS = 2
"""Words of an entry of the list of templates."""


@dataclass(frozen=True)
class AlignmentFigures:
    """The figures of ``alignment.toml``; see there."""

    coarse_m: float
    coarse_rad: float
    residual_m: float
    residual_rad: float
    residual_voxels: float
    tolerance_m: float
    drag_base_s: float
    drag_per_bit_s: float
    views: int
    axes: int
    axes_again: int


@dataclass(frozen=True)
class Aligned:
    """A template that a person has laid over a cloud.

    Attributes:
        pose: that the person takes for right.
        fit: how well the cloud fitted; the person sees this.

    """

    pose: Pose
    fit: Fit


@cache
def load_alignment() -> AlignmentFigures:
    """The figures of ``alignment.toml``."""
    text = resources.files("teleop_sim.operators").joinpath("alignment.toml").read_text(encoding="utf-8")
    return AlignmentFigures(**{name: entry["value"] for name, entry in tomllib.loads(text).items()})


def align(
    template: Template,
    cloud: VoxelCloud,
    eye_m: Triple,
    rng: np.random.Generator,
    figures: AlignmentFigures | None = None,
    near: Pose | None = None,
) -> Aligned | None:
    """Lay a template over a cloud.

    Args:
        template: that the person has chosen.
        cloud: the message that has arrived.
        eye_m: (3,) where it was seen from, in the cloud's frame.
        rng: background, first laying, residual. As many draws whatever the cloud.
        figures: of the person; those of ``alignment.toml`` if left out.
        near: where the template lies already, to be laid anew from there.

    Returns:
        None if the cloud shows next to nothing.

    """
    figures = load_alignment() if figures is None else figures
    draws, background = rng.standard_normal((4, 3)), np.random.default_rng(rng.integers(2**63))
    points = cloud.centres_m()
    if len(points) < LEAST_POINTS:
        return None
    seen = prepared(template, points, cloud.voxel_m, background, eye_m)
    if not len(seen):
        return None
    start = near
    if start is None:
        start = first_laying(template, seen, eye_m)
        start = disturbed(template, start, figures.coarse_m * draws[0], figures.coarse_rad * draws[1])
    fit = fit_template(template, seen, start)
    if fit.borne < LEAST_BORNE:
        # Nothing stands off where the template's handle is: it is taken to where something does, and laid once more.
        fit = max(fit, fit_template(template, seen, first_laying(template, seen, eye_m)), key=lambda one: one.borne)
    left_m = math.hypot(figures.residual_m, figures.residual_voxels * cloud.voxel_m)
    left_rad = figures.residual_rad * left_m / figures.residual_m if figures.residual_m else figures.residual_rad
    return Aligned(disturbed(template, fit.pose, left_m * draws[2], left_rad * draws[3]), fit)


def first_laying(template: Template, cloud: Prepared, eye_m: Triple) -> Pose:
    """Where a look at the points puts the template: of some layings the one that fits best.

    Its middle goes to the middle of the points, or what stands off its face to what stands off theirs, on this side;
    its x axis goes level and about away from the eye.
    """
    points, eye = cloud.points, np.array(eye_m)
    middle = np.median(points, axis=0)
    pairs = [(middle, np.array(template.middle_m))]
    if cloud.off.any() and not cloud.off.all():
        pairs.append((np.median(points[cloud.off], axis=0), np.array(template.handle_m)))
    way = middle[:2] - eye[:2]
    heading = math.atan2(float(way[1]), float(way[0]))
    handle = handle_of(template)
    if handle is not None:
        place, point = pairs[-1]
        m = rotation((0.0, 0.0, heading))
        return laid_on_face(handle, cloud, pose_of(place - m @ point, m), math.inf)
    matrices = [rotation((0.0, 0.0, heading + turn)) for turn in HEADINGS_RAD]
    return fit_roughly(template, cloud, [pose_of(place - m @ point, m) for place, point in pairs for m in matrices])


def disturbed(template: Template, pose: Pose, shift_m: Floats, turn_rad: Floats) -> Pose:
    """A pose shifted by (3,) [m] and turned by a rotation vector (3,) [rad] about the template's middle."""
    middle = np.array(template.middle_m)
    matrix = rotation(turn_rad) @ pose.matrix
    return pose_of(pose.place(middle) + shift_m - matrix @ middle, matrix)


def alignment_elements(
    timing: OperatorTiming, figures: AlignmentFigures, voxel_m: float, again: bool = False
) -> tuple[tuple[str, float], ...]:
    """The acts of laying a template, each with its mean time [s].

    Find the thing in picture and cloud; choose the template from a list and put it there; for each handle: prepare,
    point, drag, verify; turn the view; confirm in the picture. The paper's Figure 16 shows that last step. ``again``:
    a template that lies there already is looked at and moved along what is seen to be off.

    Source of the acts: Romay et al., section 3.3, step 1, and Figure 16; of the times: the keystroke-level model.
    """
    find = timing.look_s + timing.search_s
    handle = timing.mental_s + timing.point_s + max(timing.click_s, drag_s(figures, voxel_m)) + timing.verify_s
    views = figures.views * (timing.point_s + timing.click_s + timing.look_s)
    confirm = timing.turn_s + find + timing.verify_s
    if again:
        return (
            ("find in the cloud", find),
            ("drag handles", figures.axes_again * handle),
            ("confirm in the picture", confirm),
        )
    choose = timing.mental_s + timing.point_s + timing.click_s + timing.search_s
    choose += CHOOSE_WORDS * timing.read_per_word_s + timing.point_s + timing.click_s
    return (
        ("find in the picture", find + timing.think_s),
        ("find in the cloud", timing.turn_s + find + timing.think_s),
        ("choose the template", choose),
        ("put it there", timing.point_s + timing.click_s + timing.verify_s),
        ("drag handles", figures.axes * handle),
        ("turn the view", views),
        ("confirm in the picture", confirm),
    )


def alignment_s(timing: OperatorTiming, figures: AlignmentFigures, voxel_m: float, again: bool = False) -> float:
    """Mean time to lay a template [s], before expertise and spread."""
    return math.fsum(seconds for _, seconds in alignment_elements(timing, figures, voxel_m, again))


def drag_s(figures: AlignmentFigures, voxel_m: float) -> float:
    """Drag a handle from where the first laying left it to within what can be seen [s].

    Fitts' law with ID = log2(2 A / W): A the mean distance along one direction, sqrt(2 / pi) standard deviations; W
    twice the tolerance, which no voxel lets one better. Source: Fitts, J. Exp. Psychol. 47 (1954), 381-391.
    """
    away_m = math.sqrt(2.0 / math.pi) * figures.coarse_m
    width_m = 2.0 * max(figures.tolerance_m, voxel_m)
    return max(0.0, figures.drag_base_s + figures.drag_per_bit_s * max(0.0, math.log2(2.0 * away_m / width_m)))
