"""A scenario's names and values as the parts of the simulator want them.

A new task is its own files and one line in ``TASKS``, beside its line in ``names.py`` that says what it is
(docs/architecture.md, *How to add*).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from teleop_sim.machines.declare import Machine
from teleop_sim.machines.drc import door_machine, valve_machine
from teleop_sim.machines.operator_only import operator_only
from teleop_sim.machines.src_dish import src_dish
from teleop_sim.operators.collaborate import Collaborate
from teleop_sim.operators.human import Human
from teleop_sim.operators.policies import Policy
from teleop_sim.operators.registry import POLICIES
from teleop_sim.operators.timing import OperatorTiming, load_timing
from teleop_sim.operators.verification import CRITERION
from teleop_sim.operators.workload import Curve
from teleop_sim.robot.programs.src_dish import dish_programs
from teleop_sim.robot.programs.vigir import vigir_programs
from teleop_sim.scenarios.disturbances import disturbance_ranges
from teleop_sim.scenarios.drc import drawn_door, drawn_valve
from teleop_sim.scenarios.links import Streams
from teleop_sim.scenarios.names import AUTONOMY
from teleop_sim.scenarios.schema import Operator, Scenario, World
from teleop_sim.scenarios.tasks import Site as Site
from teleop_sim.scenarios.tasks import Task as Task
from teleop_sim.world import dish_scorer, drc_scorer
from teleop_sim.world.dish_draw import DishSettings, draw_dish_world
from teleop_sim.world.dish_layout import middle_of_walkway
from teleop_sim.world.dish_scenery import DishScenery, DishScore
from teleop_sim.world.disturbance_draw import Ground, draw_disturbances
from teleop_sim.world.disturbances import Disturbances
from teleop_sim.world.drc_draw import Placed
from teleop_sim.world.robot_model import RobotModel


def dish_site(scenario: Scenario, streams: Streams) -> Site:
    """The world of the dish task, drawn."""
    world = draw_dish_world(streams, dish_settings(scenario.world or World()))
    ground = Ground(middle_of_walkway(world.layout_id), world.floor_friction)
    return Site(DishScenery(world), partial(DishScore.start, world, time_limit_s=scenario.time_limit_s), ground)


def door_site(scenario: Scenario, streams: Streams) -> Site:
    """The door, drawn."""
    door, thing = drawn_door(scenario, streams)
    return Site(door, drc_scorer.door_score, _way_to(thing, door.friction), thing)


def valve_site(scenario: Scenario, streams: Streams) -> Site:
    """The valve, drawn."""
    valve, thing = drawn_valve(scenario, streams)
    return Site(valve, drc_scorer.valve_score, _way_to(thing, valve.friction), thing)


def _way_to(thing: Placed, friction: float) -> Ground:
    return Ground(((0.0, 0.0), (max(thing.ahead_m, 0.1), 0.0)), friction)


def _by_layer(behaviour: Callable[[str], Machine]) -> Callable[[str, str], Machine]:
    return lambda robot, layer: behaviour(robot) if layer == "behaviour" else operator_only()


TASKS: Mapping[str, Task] = {
    "drc-door": Task(
        _by_layer(door_machine), vigir_programs, door_site, drc_scorer.PUSHED, ends_when_scored=True, template="door"
    ),
    "drc-valve": Task(
        _by_layer(valve_machine),
        vigir_programs,
        valve_site,
        drc_scorer.WHOLE_TURN,
        ends_when_scored=True,
        template="DRC_valve",
    ),
    "src-dish": Task(lambda _robot, _layer: src_dish(), dish_programs, dish_site, dish_scorer.LAST_CHECKPOINT),
}
"""Name in a scenario to task."""


def machine_of(scenario: Scenario) -> Machine:
    """What is done in which order, at the scenario's layer of control."""
    return TASKS[scenario.task].machine(scenario.robot, scenario.layer or "behaviour")


def drawn_disturbances(scenario: Scenario, streams: Streams, site: Site, robot: RobotModel) -> Disturbances:
    """What goes otherwise in a run than its robot believes.

    Raises:
        UnknownName: the robot has no such link for the payload.

    """
    return draw_disturbances(streams, disturbance_ranges(scenario.disturbances), site.ground, robot)


def operator_timing(operator: Operator) -> OperatorTiming:
    """How long the scenario's operator takes."""
    return load_timing(expertise=operator.expertise)


def operator_policy(operator: Operator) -> Policy:
    """How the scenario's operator decides."""
    policy = POLICIES[operator.policy]()
    if isinstance(policy, Collaborate) and operator.level_there is not None:
        return replace(policy, level_there=AUTONOMY[operator.level_there])
    return policy


def operator_human(operator: Operator) -> Human:
    """What goes wrong with the scenario's people."""
    return Human(operator.slip_rate or 0.0, operator.misjudge_rate or 0.0, Curve() if operator.workload else None)


def operator_criterion(operator: Operator) -> float:
    """The evidence above which the scenario's people reject a claim."""
    return CRITERION if operator.criterion is None else operator.criterion


def dish_settings(world: World) -> DishSettings:
    """What the world is drawn with."""
    return DishSettings(
        layout_id=world.layout if isinstance(world.layout, int) else None,
        wheel_friction_nm=world.wheel_friction_nm,
        wheel_start_spread_rad=world.wheel_start_spread_rad,
        yaw_target_rad=world.yaw_target_rad,
        pitch_target_rad=world.pitch_target_rad,
        floor_friction=world.floor_friction,
        contact_friction=world.contact_friction,
        console_jitter_m=world.console_jitter_m,
        console_jitter_rad=world.console_jitter_rad,
        clutter=world.clutter,
        drums=(0, 0) if world.drums is None else world.drums,
    )


def autonomy_level(scenario: Scenario) -> int:
    """The guard's level, 0 to 3."""
    return AUTONOMY[scenario.autonomy]
