"""The plant: one MuJoCo model and its data. Everything that moves is in here, and nothing else steps it.

Settings were measured to hold (docs/physics.md): ``implicitfast``, Newton, elliptic cones, impratio 10; 4 ms a step,
one control tick every 20 ms. ``ls_iterations`` must not be lowered: walks fail.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import mujoco
import numpy as np

from teleop_sim.core.views import Frame, SceneTree, Solid
from teleop_sim.world.contact import ROBOT_GROUP, hand_of
from teleop_sim.world.description import Vector
from teleop_sim.world.disturbances import CALM, Disturbances, burdened, change_ground, push_now
from teleop_sim.world.light import Light
from teleop_sim.world.robot_model import RobotModel, add_robot
from teleop_sim.world.shapes import frames_and_solids
from teleop_sim.world.timers import stop_timers

TIMESTEP_S = 0.004
TICK_S = 0.02
GRAVITY_M_S2 = 9.81
_STATE = mujoco.mjtState.mjSTATE_INTEGRATION
_SPARSE_FROM = 4_000_001
"""mujoco 4.0.0 factors a sparse Hessian wrongly; 4.0.1 mended it (its release notes, #3767)."""

stop_timers()


class Scenery(Protocol):
    """What stands round the robot and how it behaves between control ticks."""

    @property
    def light(self) -> Light:
        """For the cameras."""

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add bodies, geoms and actuators to the model, after the robot."""

    def tick(self, plant: Plant, memory: tuple[float, ...]) -> tuple[float, ...]:
        """Set the scenery's own actuators for the next tick; return the scenery's memory."""

    def status(self, plant: Plant, memory: tuple[float, ...]) -> dict[str, float]:
        """The status message that the task sends the robot; empty when there is none."""


@runtime_checkable
class HasPlaces(Protocol):
    """A scenery that tells where things truly are, so that a log can say how wrong a robot's sighting was."""

    def places(self, plant: Plant) -> Mapping[str, Vector]:
        """Middles by name, odometry frame [m]."""


@dataclass(frozen=True)
class PlantState:
    """All of MuJoCo's state but the time, and the scenery's memory. A value: equal states give equal futures.

    ``ticks``: how long the robot has been moving, up to the end of the last push.
    """

    physics: bytes
    memory: tuple[float, ...] = ()
    ticks: int = 0


@dataclass(frozen=True)
class Pose:
    """A frame in the world: rotation (3, 3), columns are its axes; position (3,) [m]."""

    rotation: np.ndarray
    position: np.ndarray


class Plant:
    """A robot in its scenery.

    Args:
        robot: the body to build.
        scenery: what stands round it.
        stopwatch: reads a clock [s] for profiling only; the simulation never sees it.
        disturbances: what is otherwise than believed.
        timestep_s: of MuJoCo; a control tick is always ``TICK_S``.
    """

    def __init__(
        self,
        robot: RobotModel,
        scenery: Scenery,
        stopwatch: Callable[[], float] | None = None,
        disturbances: Disturbances = CALM,
        timestep_s: float = TIMESTEP_S,
    ) -> None:
        spec = _options(timestep_s)
        add_robot(spec, burdened(robot, disturbances))
        scenery.add_to(spec)
        change_ground(spec, disturbances)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        # Asking MuJoCo's structures for an array makes a new view each time: microseconds of every tick.
        self._qpos: np.ndarray = self.data.qpos
        self._ctrl: np.ndarray = self.data.ctrl
        self.scenery = scenery
        self.memory: tuple[float, ...] = ()
        self.stopwatch = stopwatch
        self.stepping_s = 0.0
        self.disturbances = disturbances
        self.steps_per_tick = round(TICK_S / timestep_s)
        self._steps_left = self.steps_per_tick - 1
        self._ticks = 0
        ends_s = max((push.start_s + push.duration_s for push in disturbances.pushes), default=0.0)
        self._last_tick = math.ceil(ends_s / TICK_S) + 1 if disturbances.pushes else 0
        self._push = self.data.xfrc_applied[self.model.body(robot.trunk).id, :3]
        names = [joint.name for joint in robot.description.depth_first()]
        self.robot_joints: tuple[str, ...] = tuple(names)
        self.nv_robot = 6 + len(names) + sum(len(mount.hand.parts) for mount in robot.hands)
        self.joint_names: tuple[str, ...] = tuple(
            self.model.joint(i).name for i in range(self.model.njnt) if self.model.jnt_type[i] != 0
        )
        places = [int(self.model.joint(name).qposadr[0]) for name in self.joint_names]
        # A slice where it serves: no copy through a list of places in every tick.
        inner = places == list(range(7, self.model.nq))
        self._angles_at: slice | list[int] = slice(7, None) if inner else places
        self._actuators = {self.model.actuator(i).name: i for i in range(self.model.nu)}
        self._qposadr = {name: int(self.model.joint(name).qposadr[0]) for name in self.joint_names}
        self._geoms = [self.model.geom(i).name for i in range(self.model.ngeom)]
        self._own_geom = [group == ROBOT_GROUP for group in self.model.geom_group.tolist()]
        self._scenes: dict[str, tuple[tuple[Frame, ...], tuple[Solid, ...]]] = {}
        self._groups = np.array([group != ROBOT_GROUP for group in range(6)], np.uint8)

    # State ---------------------------------------------------------------------------------------------------------

    def save(self) -> PlantState:
        """The state now, without the time: physics does not depend on it."""
        state = np.empty(mujoco.mj_stateSize(self.model, _STATE))
        mujoco.mj_getState(self.model, self.data, state, _STATE)
        state[0] = 0.0
        return PlantState(state.tobytes(), self.memory, self._ticks)

    def load(self, state: PlantState, time_s: float = 0.0) -> None:
        """Go to a state at a time of the one clock."""
        values = np.frombuffer(state.physics).copy()
        values[0] = time_s
        mujoco.mj_setState(self.model, self.data, values, _STATE)
        mujoco.mj_forward(self.model, self.data)
        # forward() may refresh the solver's warm start; only the saved one repeats bit for bit.
        mujoco.mj_setState(self.model, self.data, values, _STATE)
        self.memory, self._ticks = state.memory, state.ticks

    @property
    def time_s(self) -> float:
        """MuJoCo's time."""
        return float(self.data.time)

    def scene(self, t_s: float, name: str, camera: str) -> SceneTree:
        """All that stands and moves, for viewers. ``name``: of the whole; ``camera``: site of the robot's camera."""
        if camera not in self._scenes:
            self._scenes[camera] = frames_and_solids(self.model, camera)
        return SceneTree(t_s, name, *self._scenes[camera], self.joint_names)

    # Stepping ------------------------------------------------------------------------------------------------------

    def begin_tick(self) -> None:
        """Bring kinematics and bias forces up to date: first half of a step, before the control law."""
        if self.stopwatch:
            self.stepping_s -= self.stopwatch()
        mujoco.mj_step1(self.model, self.data)
        self.memory = self.scenery.tick(self, self.memory)
        if self._ticks < self._last_tick:
            self._ticks += 1
            self._push[:] = push_now(self.disturbances.pushes, (self._ticks - 0.5) * TICK_S)
        if self.stopwatch:
            self.stepping_s += self.stopwatch()

    def end_tick(self) -> None:
        """Second half of that step with the controls now set, then the rest of the tick."""
        if self.stopwatch:
            self.stepping_s -= self.stopwatch()
        mujoco.mj_step2(self.model, self.data)
        mujoco.mj_step(self.model, self.data, self._steps_left)
        if self.stopwatch:
            self.stepping_s += self.stopwatch()

    # Reading -------------------------------------------------------------------------------------------------------

    def angle(self, joint: str) -> float:
        """Position of one joint [rad or m]."""
        return float(self._qpos[self._qposadr[joint]])

    def angles(self) -> np.ndarray:
        """Positions of all joints but the root and free bodies, in the order of ``joint_names``."""
        return self._qpos[self._angles_at].copy()

    def set_angle(self, joint: str, value: float) -> None:
        """Place one joint; for setting up, not for moving."""
        self._qpos[self._qposadr[joint]] = value

    def set_control(self, actuator: str, value: float) -> None:
        """Set one actuator's control."""
        self._ctrl[self._actuators[actuator]] = value

    def pelvis(self) -> np.ndarray:
        """Root position and quaternion w, x, y, z, (7,)."""
        return self._qpos[:7].copy()

    def positions(self) -> np.ndarray:
        """All that ``pelvis_and_angles`` reads, now."""
        return self._qpos.copy()

    def pelvis_and_angles(self, positions: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """``pelvis`` (n, 7) and ``angles`` (n, k) at each of ``positions``."""
        table = np.array(positions).reshape(len(positions), self.model.nq)
        return table[:, :7].copy(), np.ascontiguousarray(table[:, self._angles_at])

    def site(self, name: str) -> Pose:
        """Pose of a named site."""
        site = self.data.site(name)
        return Pose(site.xmat.reshape(3, 3).copy(), site.xpos.copy())

    def touch_n(self, name: str) -> float:
        """Reading of a touch sensor [N]."""
        return float(self.data.sensor(name).data[0])

    def sensor(self, name: str) -> np.ndarray:
        """View of a sensor's reading, which follows it from then on."""
        first, size = int(self.model.sensor(name).adr[0]), int(self.model.sensor(name).dim[0])
        reading: np.ndarray = self.data.sensordata[first : first + size]
        return reading

    def contacts(self) -> tuple[tuple[str, str], ...]:
        """Names of the geoms now touching, each pair (robot's, world's or its own) once.

        What touches in the world by itself, as a bolt its strike, is left out.
        """
        names, own = self._geoms, self._own_geom
        pairs = ((a, b) for a, b in self.data.contact.geom.tolist() if own[a] or own[b])
        touching = ((b, a) if own[b] else (a, b) for a, b in pairs)
        # A dict keeps the order in which they were found.
        return tuple({(names[a], names[b]): None for a, b in touching})

    # Rays ----------------------------------------------------------------------------------------------------------

    def cast(
        self, origin: np.ndarray, directions: np.ndarray, cutoff_m: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cast rays at the world; the robot's own geoms are left out.

        Args:
            origin: (3,). directions: (n, 3) unit vectors. cutoff_m: nothing beyond is hit.

        Returns:
            Distances (n,) [m], -1 for nothing; geom ids (n,); surface normals (n, 3).
        """
        return self._cast(origin, directions, cutoff_m, self._groups, -1)

    def cast_robot(
        self, origin: np.ndarray, directions: np.ndarray, cutoff_m: float, frame: str, alone: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Cast rays at the robot itself, in the world or alone.

        Args:
            origin: (3,). directions: (n, 3) unit vectors. cutoff_m: nothing beyond is hit.
            frame: site of the sensor; the body that carries it is its housing, and is left out.
            alone: as if there were no world, which else hides what is behind it.

        Returns:
            Distances (n,) [m], -1 for nothing; geom ids (n,).
        """
        housing = int(self.model.site(frame).bodyid[0])
        groups = 1 - self._groups if alone else np.ones(6, np.uint8)
        distances, geoms, _ = self._cast(origin, directions, cutoff_m, groups, housing)
        return distances, geoms

    def on_hand(self, geoms: np.ndarray, side: str) -> np.ndarray:
        """Whether geoms, by id, are those of a hand; (n,)."""
        own = self.model.geom_group == ROBOT_GROUP
        hands: np.ndarray = own & (self.model.geom_contype == hand_of(side)["contype"])
        return np.asarray((geoms >= 0) & hands[geoms])

    def _cast(
        self, origin: np.ndarray, directions: np.ndarray, cutoff_m: float, groups: np.ndarray, without: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        n = len(directions)
        geoms, distances, normals = np.empty(n, np.int32), np.empty(n), np.empty(3 * n)
        flat = np.ascontiguousarray(directions, float).ravel()
        mujoco.mj_multiRay(
            self.model, self.data, origin, flat, groups, 1, without, geoms, distances, normals, n, cutoff_m
        )
        return distances, geoms, normals.reshape(-1, 3)

    def colour(self, geoms: np.ndarray) -> np.ndarray:
        """Red, green, blue (n, 3) of geoms, 0 to 1."""
        rgb: np.ndarray = self.model.geom_rgba[geoms, :3]
        return rgb

    def textured(self, geoms: np.ndarray) -> np.ndarray:
        """Whether geoms have a material, (n,)."""
        has: np.ndarray = self.model.geom_matid[geoms] >= 0
        return has


def _options(timestep_s: float) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    option = spec.option
    option.timestep = timestep_s
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # Sparse: walks 1.09 times as fast, manipulation 1.18 times (measured with 4.0.1).
    sparse = mujoco.mj_version() >= _SPARSE_FROM
    option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE if sparse else mujoco.mjtJacobian.mjJAC_DENSE
    option.impratio = 10.0
    option.iterations = 100
    option.ls_iterations = 50
    option.tolerance = 1e-8
    # One robot is one island: looking for others costs 8 % of a step and finds none worth it (measured).
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    option.gravity = [0.0, 0.0, -GRAVITY_M_S2]
    return spec
