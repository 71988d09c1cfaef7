"""SRC task 1 as scenery round a robot: the scene, the dish that follows its wheels, and the status it sends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from teleop_sim.world import console, dish_scorer
from teleop_sim.world import dish_layout as lay
from teleop_sim.world.description import Vector
from teleop_sim.world.dish import SOIL_Z_M, DishSignals, add_dish_world
from teleop_sim.world.dish_draw import DishWorld
from teleop_sim.world.light import Light
from teleop_sim.world.plant import Plant

Memory = tuple[float, ...]
"""One number: 1.0 once the pelvis has been in front of the console (checkpoint 1), else empty or 0.0."""


class DishScenery:
    """The dish task's world with its one rule for physics: from checkpoint 1 on the dish follows the wheels."""

    def __init__(self, world: DishWorld) -> None:
        self.world = world
        self._square = lay.checkpoint_1(world.dish)
        self._scorer = dish_scorer.start(world)

    @property
    def light(self) -> Light:
        """Sun and sky."""
        return self.world.light

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add soil, walkway, console, wheels, dish."""
        add_dish_world(spec, self.world)

    def tick(self, plant: Plant, memory: Memory) -> Memory:
        """Latch checkpoint 1; send the wheels' angles to the dish."""
        reached = bool(memory and memory[0]) or self._in_front(plant)
        yaw, pitch = signals(plant).dish_command_rad(1 if reached else 0)
        plant.set_control("dishYaw", yaw)
        plant.set_control("dishPitch", pitch)
        return (1.0,) if reached else ()

    def status(self, plant: Plant, memory: Memory) -> dict[str, float]:
        """What the dish tells the robot while it acts; the hold timers are the scorer's, not known here."""
        if not memory:
            return {}
        at = signals(plant)
        state = dish_scorer.ScorerState(self._scorer.task, checkpoint=1)
        return dish_scorer.status(state, 0.0, at.dish_yaw_rad, at.dish_pitch_rad)

    def places(self, plant: Plant) -> dict[str, Vector]:
        """Middles of wheels and knobs now; see ``HasPlaces``."""
        at, (yaw, pitch) = signals(plant), self.world.wheel_start_rad
        # A joint turns clockwise, a handle's angle counts anticlockwise (world/console.py).
        return {
            "yaw_wheel": self._place(console.wheel_centre(True)),
            "pitch_wheel": self._place(console.wheel_centre(False)),
            "yaw_handle": self._place(console.knob_centre(True, yaw - at.yaw_wheel_rad)),
            "pitch_handle": self._place(console.knob_centre(False, pitch - at.pitch_wheel_rad)),
        }

    def _place(self, inside: Vector) -> Vector:
        x, y, yaw = self.world.console
        c, s = math.cos(yaw), math.sin(yaw)
        return (x + c * inside[0] - s * inside[1], y + s * inside[0] + c * inside[1], SOIL_Z_M + inside[2])

    def _in_front(self, plant: Plant) -> bool:
        pelvis = plant.pelvis()
        return lay.inside(self._square, lay.CHECKPOINT_SIDE_M, float(pelvis[0]), float(pelvis[1]))


def signals(plant: Plant) -> DishSignals:
    """Joint angles of wheels and dish now."""
    return DishSignals(
        yaw_wheel_rad=plant.angle("yawWheel"),
        pitch_wheel_rad=plant.angle("pitchWheel"),
        dish_yaw_rad=plant.angle("dishYaw"),
        dish_pitch_rad=plant.angle("dishPitch"),
    )


@dataclass(frozen=True)
class DishScore:
    """The scorer with the places of the dish's joints among the plant's."""

    state: dish_scorer.ScorerState
    yaw_joint: int
    pitch_joint: int

    @staticmethod
    def start(world: DishWorld, joint_names: tuple[str, ...], time_limit_s: float) -> DishScore:
        """The score before anything happened."""
        state = dish_scorer.start(world, time_limit_s)
        return DishScore(state, joint_names.index("dishYaw"), joint_names.index("dishPitch"))

    @property
    def checkpoint(self) -> int:
        """The last checkpoint scored."""
        return self.state.checkpoint

    def at(self, t_s: float, pelvis: np.ndarray, joints: np.ndarray) -> tuple[DishScore, tuple[tuple[int, str], ...]]:
        """The score after a sample, and what it saw."""
        at = (float(pelvis[0]), float(pelvis[1]))
        yaw, pitch = float(joints[self.yaw_joint]), float(joints[self.pitch_joint])
        state, events = dish_scorer.advance(self.state, t_s, at, yaw, pitch)
        seen = tuple((event.checkpoint, event.text) for event in events)
        return (self if state is self.state else replace(self, state=state)), seen

    def quiet(self, t_s: np.ndarray, pelvis: np.ndarray, joints: np.ndarray) -> int:
        """How many of these samples change nothing; see ``dish_scorer.quiet``."""
        return dish_scorer.quiet(self.state, t_s, pelvis[:, :2], joints[:, self.yaw_joint], joints[:, self.pitch_joint])

    def next_s(self, t_s: float) -> float:
        """When a frozen robot must be sampled next."""
        return dish_scorer.next_event_s(self.state, t_s)

    def status(self, t_s: float, joints: np.ndarray) -> dict[str, float]:
        """The dish's status message, hold timers included."""
        yaw, pitch = float(joints[self.yaw_joint]), float(joints[self.pitch_joint])
        return dish_scorer.status(self.state, t_s, yaw, pitch)
