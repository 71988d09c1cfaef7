"""What the robot feels besides its joints: forces at ankles and wrists, and its inertial unit in the pelvis.

All three robots have six-axis sensors in their feet and wrists or hands and an inertial unit in the pelvis (their
public models name most of these frames); here each sits where its link begins. Readings are exact: noise, bias, drift,
range and the sensors' own rates are not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.robot.body import Body
from teleop_sim.robot.commands import Side
from teleop_sim.world.senses import Inertial, Wrench, inertial, wrenches


@dataclass(frozen=True)
class Senses:
    """One reading of everything, of the last physics step.

    Attributes:
        feet: left and right, at the last joint of the leg: what the foot gets from the leg, in the foot's axes.
        wrists: by side, at the last joint of the arm: what the hand gets from the arm, in the palm's axes.
        pelvis: turning rates and specific force at the root link's origin, in its axes.
    """

    feet: tuple[Wrench, Wrench]
    wrists: dict[Side, Wrench]
    pelvis: Inertial


def feel(body: Body) -> Senses:
    """Read all sensors; it costs some microseconds and changes nothing."""
    model = body.spec.model
    sole = model.description.sole
    palms = {side: mount.palm for side in body.hands for mount in model.hands if mount.side == side}
    left, right, *hands = wrenches(body.plant, (sole.left, sole.right, *palms.values()))
    return Senses((left, right), dict(zip(palms, hands, strict=True)), inertial(body.plant, model.description.root))
