"""What a scenario's crew brings to work with templates: its server, how it lays one and works through it by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from teleop_sim.channel.template_ends import StationTemplates
from teleop_sim.operators.clouds import Region
from teleop_sim.operators.memo import FreshEyes
from teleop_sim.operators.plan_review import GOAL, PLAN, GoalGiver, PlanReviewer
from teleop_sim.operators.template_giver import SELECTED_OBJECT, TemplateGiver
from teleop_sim.operators.template_layer import TemplateLayer
from teleop_sim.robot.programs.vigir_arms import HAND_TYPES
from teleop_sim.scenarios.objects import operator_criterion, operator_timing
from teleop_sim.templates.library import library

if TYPE_CHECKING:
    from collections.abc import Mapping

    from teleop_sim.operators.desk import Giver
    from teleop_sim.scenarios.schema import Scenario
    from teleop_sim.templates.poses import Triple
    from teleop_sim.world.drc_draw import Placed

EYE_M = (0.0, 0.0, 1.5)
"""Where the crew takes the robot's sensor to be at the start (assumed: a head's height; only its direction counts)."""
VOXEL_MM = 20
"""Voxels of the first cloud that is asked for (assumed)."""


@dataclass(frozen=True)
class Tools:
    """Of one crew: they hold what it has done. Empty where the task has no template."""

    templates: StationTemplates | None = None
    givers: Mapping[str, Giver] = field(default_factory=dict)
    hands: TemplateLayer | None = None


def crew_tools(
    scenario: Scenario,
    template: str,
    thing: Placed | None,
    round_trip_s: float,
    eyes: FreshEyes | None = None,
) -> Tools:
    """For a crew that starts.

    Args:
        scenario: whose crew. template: name in the library. thing: what the map of the course says of its place.
        round_trip_s: announced.
        eyes: how they lay templates, worked out (default) or remembered.

    """
    if thing is None:
        return Tools()
    station = StationTemplates(round_trip_s)
    eye: Triple = EYE_M
    region = Region(thing.nominal, VOXEL_MM)
    giver = TemplateGiver(station, library().named(template), eye, region=region, eyes=eyes or FreshEyes())
    givers: dict[str, Giver] = {SELECTED_OBJECT: giver, PLAN: PlanReviewer(), GOAL: GoalGiver(giver, scenario.robot)}
    hands = TemplateLayer(
        giver,
        operator_timing(scenario.operator),
        hand=HAND_TYPES[scenario.robot],
        criterion=operator_criterion(scenario.operator),
        watched=(scenario.operator.team or 1) > 1,
    )
    return Tools(station, givers, hands)
