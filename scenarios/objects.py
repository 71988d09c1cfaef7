"""A scenario's values as the parts of the simulator want them: names to objects. Imports the parts when called."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teleop_sim.scenarios.names import AUTONOMY
from teleop_sim.scenarios.schema import LinkDirection, Operator, Scenario, World

if TYPE_CHECKING:
    from teleop_sim.channel.link import DirectionSettings
    from teleop_sim.operators.policies import Policy
    from teleop_sim.operators.timing import OperatorTiming
    from teleop_sim.world.dish import DishSettings


def direction_settings(direction: LinkDirection) -> DirectionSettings:
    """What ``channel.link.Direction`` is made with."""
    from teleop_sim.channel.link import DirectionSettings

    return DirectionSettings(direction.rate_bps, direction.delay_s, direction.header_bytes, direction.blackouts)


def operator_timing(operator: Operator) -> OperatorTiming:
    """How long the scenario's operator takes."""
    from teleop_sim.operators.timing import load_timing

    return load_timing(expertise=operator.expertise)


def operator_policy(operator: Operator) -> Policy:
    """How the scenario's operator decides."""
    from teleop_sim.operators.policies import POLICIES

    return POLICIES[operator.policy]()


def dish_settings(world: World) -> DishSettings:
    """What the world is drawn with."""
    from teleop_sim.world.dish import DishSettings

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
    )


def autonomy_level(scenario: Scenario) -> int:
    """The guard's level, 0 to 3."""
    return AUTONOMY[scenario.autonomy]
