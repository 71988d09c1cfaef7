"""The robot's body under control: what it feels of itself, and one control tick."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from teleop_sim.robot import law, numba_start
from teleop_sim.robot.arrays import dofs, law_arrays, sole_loads
from teleop_sim.robot.commands import PlanarPose, Side
from teleop_sim.robot.gait import Plan, stand_row
from teleop_sim.robot.law import Arrays
from teleop_sim.robot.law_wires import wire
from teleop_sim.robot.skill import Tick
from teleop_sim.robot.spec import RobotSpec
from teleop_sim.world.belief import Belief, Load
from teleop_sim.world.disturbances import believed
from teleop_sim.world.plant import GRAVITY_M_S2, TICK_S, Plant, PlantState, Pose

SIDES: tuple[Side, Side] = ("left", "right")

FALL_HEIGHT = 0.7
"""Share of the standing pelvis height under which the robot has fallen."""

FALL_TILT_COS = 0.75
"""Cosine of the pelvis tilt (41 degrees) beyond which it has fallen; height alone misses late topples."""


@dataclass(frozen=True)
class Unfinished:
    """The rest of a walking plan that was cut: rows (n, law.COLUMNS) as bytes, rows at which a foot has landed."""

    rows: bytes
    step_ends: tuple[int, ...]


@dataclass(frozen=True)
class RobotState:
    """The plant's state and the controller's: a value, so that an episode is a function of it."""

    plant: PlantState
    posture: tuple[float, ...]
    jaws: tuple[float, float]
    memory: tuple[float, ...]
    fallen: bool = False
    unfinished: Unfinished | None = None
    felt: bytes = b""
    loads: tuple[Load, ...] = ()
    torque: tuple[float, ...] = ()


class Body:
    """One robot in one plant. Mutable scratch: ``load`` a state, tick, ``save``.

    Attributes:
        upper_names: joints of torso, neck and arms, in the model's order.
        hands: sides that have a hand.
        joint_names: all joints but the jaws.
        unfinished: the plan that was cut before this state.
        walking: the plan now followed, and the row reached.
        posture: (n_upper,) present reference of the upper body [rad]. jaws: present references.
        loads: what the hands carry, as the controller was told.
        torque: (n_upper,) that holds what a hand presses on since the last skill [N m]; None where there is nothing.
        com_height_m: of the standing robot over its soles.
    """

    tick_s = TICK_S

    def __init__(self, spec: RobotSpec, plant: Plant) -> None:
        numba_start.start()
        self.spec, self.plant = spec, plant
        model = plant.model
        self.joint_names = plant.robot_joints
        self.upper_names = spec.upper
        dof = dofs(plant)
        self.hands = tuple(side for side in SIDES if any(mount.side == side for mount in spec.model.hands))
        parts = {mount.side: mount.hand.parts for mount in spec.model.hands}
        self._jaws = {side: [f"{side}{part.name}" for part in parts[side]] for side in self.hands}
        self._jaw_controls = tuple(
            (dof[name] - 6, part.drive.open_q, part.drive.shut_q - part.drive.open_q, SIDES.index(side))
            for side in self.hands
            for name, part in zip(self._jaws[side], parts[side], strict=True)
        )
        for side in self.hands:
            for name, part in zip(self._jaws[side], parts[side], strict=True):
                plant.set_angle(name, part.drive.open_q)
        self._jaw_touch = {side: [plant.sensor(f"{name}_touch") for name in self._jaws[side]] for side in self.hands}
        self._joint_qpos = np.array([int(model.joint(n).qposadr[0]) for n in self.joint_names])
        foot = spec.model.description.sole
        self._feet = (foot.left, foot.right)
        self._own_belief = self._belief = believe(spec, plant)
        self._own_arrays = self._arrays = law_arrays(spec, plant, self._belief)
        self._loaded: tuple[Belief, Arrays] | None = None
        self.loads: tuple[Load, ...] = ()
        self._loads = sole_loads(spec, plant)
        self._upper_qpos = self._arrays.qposadr[self._arrays.upper]
        self._still = np.zeros(len(self.upper_names))
        self._qpos, self._controls = plant.data.qpos, plant.data.ctrl
        self._memory = np.zeros(law.MEMORY)
        self.posture = np.zeros(len(self.upper_names))
        self.jaws = (0.0, 0.0)
        self.torque: np.ndarray | None = None
        self._jaws_set: tuple[float, float] | None = None
        self.fallen = False
        self.unfinished: Unfinished | None = None
        self.walking: tuple[Plan, int] | None = None
        self.stand: np.ndarray = np.zeros(law.COLUMNS)
        self._stance = self._solve_stance()

    # Setting up ----------------------------------------------------------------------------------------------------

    def _solve_stance(self) -> RobotState:
        """Bent knees, soles flat at z = 0, centre of mass over the soles' middle (bisection on the hips)."""
        plant = self.plant
        for name, value in zip(self.upper_names, self.named_posture("walk"), strict=True):
            plant.set_angle(name, float(value))
        plant.data.qpos[:7] = [0.0, 0.0, 1.2, 1.0, 0.0, 0.0, 0.0]
        low, high = -0.2, 1.2
        for _ in range(60):
            middle = (low + high) / 2
            if self._com_ahead_m(middle) > 0:
                low = middle
            else:
                high = middle
        self._com_ahead_m(low)
        soles = self.soles()
        height_m = self.com()[2] - soles[0].position[2]
        plant.data.qpos[2] -= soles[0].position[2] + 0.0005
        x, y = body_xy(soles)
        plant.data.qpos[0] -= x
        plant.data.qpos[1] -= y
        plant.load(plant.save())
        self.com_height_m = float(height_m)
        self.pelvis_height_m = float(plant.data.qpos[2])
        self._low_m = FALL_HEIGHT * self.pelvis_height_m
        self._gains = self._nominal_gains()
        self._figures = np.array(self._gains)
        self._wires = wire(self._figures, self._memory, self._arrays)
        memory = [0.0] * law.MEMORY
        memory[law.LANDED] = memory[law.LANDED + 1] = 1.0
        return RobotState(plant.save(), tuple(map(float, self.named_posture("walk"))), (0.0, 0.0), tuple(memory))

    def _nominal_gains(self) -> law.Gains:
        source = self.plant if self._belief is None else self._belief
        mass_kg = float(source.model.body_subtreemass[1])
        half = np.array(self.spec.model.description.sole.size_m) / 2
        return law.Gains(
            omega=float(np.sqrt(GRAVITY_M_S2 / self.com_height_m)),
            mass_kg=mass_kg,
            half_length_m=float(half[0]),
            half_width_m=float(half[1]),
            # A landing is felt at 6 % of the weight (80 N for Valkyrie, measured).
            touchdown_n=80.0 * mass_kg / 136.0,
            tick_s=TICK_S,
            gravity=GRAVITY_M_S2,
            **self.spec.gains,
        )

    def _com_ahead_m(self, hip_rad: float) -> float:
        """Centre of mass ahead of the soles' middle with the hips flexed by ``hip_rad``; more flexion leans back."""
        angles = (-hip_rad, self.spec.knee_rad, hip_rad - self.spec.knee_rad)
        for leg in self.spec.legs:
            for name, value in zip(leg[2:5], angles, strict=True):
                # Some robots mirror their pitch axes.
                pitch = self.spec.model.description.joint(name).axis[1]
                self.plant.set_angle(name, float(np.copysign(value, value * pitch)))
        self.plant.load(self.plant.save())
        if self._belief is not None:
            self._belief.load(b"")
        self._feel()
        return float(self.com()[0] - body_xy(self.soles())[0])

    def standing(self) -> RobotState:
        """The robot at the origin, just put down."""
        return self._stance

    def named_posture(self, name: str) -> np.ndarray:
        """(n_upper,) angles of a posture; joints without a name in it are at zero or 2 % inside their nearer limit."""
        posture = self.spec.postures[name]
        values = []
        for joint in self.upper_names:
            limits = self.spec.model.description.joint(joint)
            margin = 0.02 * (limits.upper_rad - limits.lower_rad)
            value = posture.get(joint, 0.0)
            values.append(min(max(value, limits.lower_rad + margin), limits.upper_rad - margin))
        return np.array(values)

    # State ---------------------------------------------------------------------------------------------------------

    def load(self, state: RobotState, time_s: float = 0.0) -> None:
        """Become that state."""
        self.plant.load(state.plant, time_s)
        self.posture = np.array(state.posture)
        self.jaws, self._jaws_set = state.jaws, None
        self.torque = np.array(state.torque) if state.torque else None
        self._memory[:] = state.memory
        self.fallen, self.unfinished, self.walking = state.fallen, state.unfinished, None
        self.carry(state.loads)
        if self._belief is not None:
            self._belief.load(state.felt)
            self._feel()
            self._belief.load(state.felt)
        self.set_stand()

    def save(self) -> RobotState:
        """The state now."""
        memory = tuple(float(x) for x in self._memory)
        posture = tuple(float(x) for x in self.posture)
        felt = b"" if self._belief is None else self._belief.save()
        torque = () if self.torque is None else tuple(float(x) for x in self.torque)
        return RobotState(
            self.plant.save(), posture, self.jaws, memory, self.fallen, self._unfinished(), felt, self.loads, torque
        )

    def _unfinished(self) -> Unfinished | None:
        if self.walking is None:
            return None
        plan, at = self.walking
        return Unfinished(plan.rows[at:].tobytes(), tuple(end - at for end in plan.step_ends if end > at))

    # Feeling -------------------------------------------------------------------------------------------------------

    def q(self) -> np.ndarray:
        """Measured angles of ``joint_names`` [rad]."""
        angles: np.ndarray = self._qpos[self._joint_qpos]
        return angles

    def upper(self) -> np.ndarray:
        """Measured angles of ``upper_names`` [rad]."""
        angles: np.ndarray = self._qpos[self._upper_qpos]
        return angles

    def base(self) -> tuple[np.ndarray, np.ndarray]:
        """Measured rotation (3, 3) and position (3,) of the pelvis."""
        body = self.plant.data.body(1)
        return body.xmat.reshape(3, 3).copy(), body.xpos.copy()

    def soles(self) -> tuple[Pose, Pose]:
        """Poses of the soles' centres, left and right."""
        return self.plant.site(f"{self._feet[0]}_sole"), self.plant.site(f"{self._feet[1]}_sole")

    def feet(self) -> tuple[PlanarPose, PlanarPose]:
        """Planar poses of the soles, left and right."""
        return self._foot(0), self._foot(1)

    def sole_places(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the soles' centres are on the ground, left and right [m]."""
        (x0, y0, _), (x1, y1, _) = self._arrays.sole.tolist()
        return (x0, y0), (x1, y1)

    def _foot(self, i: int) -> PlanarPose:
        at, turned = self._arrays.sole[i], self._arrays.sole_rotation[i]
        return float(at[0]), float(at[1]), float(np.arctan2(turned[3], turned[0]))

    def com(self) -> np.ndarray:
        """Centre of mass (3,), where it is believed to be."""
        com: np.ndarray = self._arrays.com.copy()
        return com

    def ground_z_m(self) -> float:
        """Height of the ground on which the feet stand, as the law remembers it."""
        return float(self._memory[law.GROUND])

    def balance_error_m(self) -> float:
        """How far the divergent component of motion is from its reference, as the law last saw it."""
        return math.hypot(*self._memory[law.ERROR : law.ERROR + 2].tolist())

    @property
    def rotation_damping(self) -> float:
        """The law's gain from the pelvis' rate of rotation to its acceleration [1/s]."""
        return self._gains.rotation_damping

    def hand_force(self, side: Side) -> float:
        """Sum of the touch sensors on what closes in the hand [N]."""
        return float(sum([reading.item() for reading in self._jaw_touch[side]]))

    def jaw_gap(self, side: Side) -> tuple[float, ...]:
        """Measured positions of the joints of a hand [m or rad]; a cage's jaws are at 0 when open."""
        return tuple(self.plant.angle(name) for name in self._jaws[side])

    def status(self) -> dict[str, float]:
        """The task's status message, as last sent to the robot."""
        return self.plant.scenery.status(self.plant, self.plant.memory)

    def speed(self) -> float:
        """Largest velocity of any degree of freedom [rad/s or m/s]."""
        return float(np.abs(self.plant.data.qvel).max())

    def has_fallen(self) -> bool:
        """Whether the pelvis is too low or tilted too far."""
        # Four numbers: a call of compiled code would cost more than the test.
        z, _, x, y = self._qpos[2:6].tolist()
        return bool(z < self._low_m or 1.0 - 2.0 * (x * x + y * y) < FALL_TILT_COS)

    # Acting --------------------------------------------------------------------------------------------------------

    def set_stand(self) -> None:
        """Take the feet as they are now for the standing reference."""
        self.stand = stand_row(self.feet(), self.com_height_m, 0.0)

    def carry(self, loads: tuple[Load, ...]) -> None:
        """Tell the controller what the hands carry from now on. The plant is not asked and not changed.

        A controller that reads the plant's own arrays gets a belief for as long as it carries something: what hangs in
        a hand is no link of the robot's.
        """
        if loads == self.loads:
            return
        if self._own_belief is not None:
            self._own_belief.bear(loads)
        elif loads:
            if self._loaded is None:
                belief = Belief(self.spec.model, GRAVITY_M_S2, 0)
                self._loaded = belief, law_arrays(self.spec, self.plant, belief)
            self._belief, self._arrays = self._loaded
            self._belief.bear(loads)
            self._feel()
        else:
            self._belief, self._arrays = self._own_belief, self._own_arrays
        self._wires = wire(self._figures, self._memory, self._arrays)
        self.loads = loads
        self._figures[law.Gains._fields.index("mass_kg")] = self._gains.mass_kg + sum(x.mass_kg for x in loads)

    def tick(self, reference: Tick) -> bool:
        """One control period of physics. Returns False when the robot has fallen."""
        plant = self.plant
        plant.begin_tick()
        if self._belief is not None:
            self._feel()
        posture, rate, torque, jaws, row = reference
        still = self._still
        law.tick(
            self.stand if row is None else row,
            posture,
            still if rate is None else rate,
            still if torque is None else torque,
            self._wires.table,
        )
        if jaws != self._jaws_set:
            for place, open_q, stroke, side in self._jaw_controls:
                self._controls[place] = open_q + stroke * jaws[side]
            self._jaws_set = jaws
        plant.end_tick()
        self.posture, self.jaws = posture, jaws
        self.fallen = self.has_fallen()
        return not self.fallen

    def _feel(self) -> None:
        """Let the belief take in the plant's state."""
        if self._belief is not None:
            data = self.plant.data
            self._belief.feel(data.qpos, data.qvel, self._loads)


def believe(spec: RobotSpec, plant: Plant) -> Belief | None:
    """A belief of its own where it differs from the plant's truth."""
    what = plant.disturbances
    if not what.deceives:
        return None
    return Belief(believed(spec.model, what), GRAVITY_M_S2, round(what.delay_s / TICK_S))


def body_xy(soles: tuple[Pose, Pose]) -> tuple[float, float]:
    """Middle of both soles."""
    x, y, _ = (soles[0].position + soles[1].position) / 2
    return float(x), float(y)
