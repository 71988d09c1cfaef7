"""A stand with a box to pick, a table to place it on, and a socket: a scene to try hands on. It is no task.

Nothing is tied to anything: box and plug are free bodies that lie on their supports, and only contacts hold them. The
handle's bar has the width and height of the handle on the solar panel of the Space Robotics Challenge (osrf/srcsim
0.8.0, models/solar_panel: half width 0.103 m, 0.034 m thick, top 0.031 m over its foot) where ``BoxKind`` does not say
otherwise; all other sizes are assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from teleop_sim.world import contact
from teleop_sim.world.bare import BareFloor
from teleop_sim.world.plant import Plant, Pose

PlanarPose = tuple[float, float, float]

MOVABLE = {"contype": 1, "conaffinity": 7, "group": 0}
"""Things that a hand can carry: unlike what is fixed, they also touch the world."""

BOX, PLUG = "box", "plug"
LEAD_M, RIM_M = 0.007, 0.033
"""Of a hole: width and depth of its funnel, and of the level rim round that (assumed)."""
GRIP = {"solref": contact.GRIP_SOLREF, "solimp": [0.97, 0.99, 0.001, 0.5, 2.0], "priority": 1}
"""Of what a hand holds: rather hard, and with priority, so that the hand's softer contacts are not mixed in.

With MuJoCo's own impedance of 0.95 a held plug creeps down by 0.13 mm/s, with 0.99 by 0.04; with 0.999 THORMANG3's
light jaws sink into a bar (measured).
"""
_WOOD, _STEEL, _RED, _BLUE = [0.6, 0.5, 0.4, 1.0], [0.5, 0.5, 0.55, 1.0], [0.7, 0.15, 0.1, 1.0], [0.15, 0.25, 0.7, 1.0]


@dataclass(frozen=True)
class BoxKind:
    """A box with a bar over it as a handle.

    Attributes:
        mass_kg: of the whole, spread evenly over the box; bar and posts weigh 1 % of it each.
        half: half sizes of the box [m]; its y is along the bar.
        bar_half_m: half length of the bar. bar_thick_m: its thickness, alike across and up.
        gap_m: free height between box and bar (assumed: a hand's bars must go through).
    """

    mass_kg: float = 2.0
    half: tuple[float, float, float] = (0.10, 0.125, 0.09)
    bar_half_m: float = 0.103
    bar_thick_m: float = 0.042
    gap_m: float = 0.12

    @property
    def handle_m(self) -> float:
        """Height of the bar's middle over the box's underside."""
        return 2 * self.half[2] + self.gap_m + self.bar_thick_m / 2


@dataclass(frozen=True)
class PlugKind:
    """An upright plug: a grip of two balls that a cage closes on, and a round peg below it.

    Balls, because MuJoCo finds only one point between a cylinder and a bar along it, which jumps from end to end: a
    cylinder walks out of a hand at 12 mm/s (measured).

    Attributes:
        mass_kg: of the whole. grip_radius_m, grip_m: of the grip's balls, and its length over the peg.
        peg_radius_m, peg_m: of the peg.
    """

    mass_kg: float = 0.5
    grip_radius_m: float = 0.034
    grip_m: float = 0.08
    peg_radius_m: float = 0.015
    peg_m: float = 0.06


@dataclass(frozen=True)
class Socket:
    """A square hole in a block, open at the top.

    Attributes:
        at: x [m], y [m], yaw [rad] of the hole. top_m: height of its rim over the floor.
        half_m: half the hole's width: the play is this less the peg's radius.
        depth_m: of the hole below its funnel, which is ``LEAD_M`` wide and deep.
    """

    at: PlanarPose
    top_m: float
    half_m: float = 0.019
    depth_m: float = 0.05


@dataclass(frozen=True, kw_only=True)
class CarryScene(BareFloor):
    """Floor, a stand with a box, a table, and, if given, a rack with a plug and a socket.

    Attributes:
        box: what stands on the stand; ``stand`` is where: x, y [m] and yaw [rad], the bar being along local y.
        stand_m, table_m: heights of both tops. table: place of the table's middle.
        plug, rack, rack_m: the plug, where it hangs, height of the rack's top; the peg hangs in the rack.
        socket: where it belongs.
        grip_friction: of box, plug and all that they touch. friction: of the floor.
    """

    stand: PlanarPose
    stand_m: float
    table: PlanarPose
    table_m: float
    box: BoxKind | None = BoxKind()
    plug: PlugKind | None = None
    rack: PlanarPose = (0.0, 0.0, 0.0)
    rack_m: float = 0.9
    socket: Socket | None = None
    grip_friction: float = 0.7

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Add everything, free bodies last."""
        super().add_to(spec)
        if self.box is not None:
            self._block(spec, "stand", self.stand, (0.13, 0.15), self.stand_m)
            self._block(spec, "table", self.table, (0.3, 0.4), self.table_m)
            self._add_box(spec, self.box)
        if self.plug is not None:
            self._frame(spec, "rack", self.rack, self.rack_m, self.plug.peg_radius_m + 0.006, self.plug.peg_m + 0.02)
            self._add_plug(spec, self.plug)
        if self.socket is not None:
            hole = self.socket
            self._frame(spec, "socket", hole.at, hole.top_m, hole.half_m, hole.depth_m)

    def _solid(self) -> dict[str, object]:
        return {"condim": 4, "friction": contact.rough(self.grip_friction), "solref": contact.SOLE_SOLREF}

    def _block(self, spec: mujoco.MjSpec, name: str, at: PlanarPose, half: tuple[float, float], top_m: float) -> None:
        """A solid block from the floor up."""
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[at[0], at[1], top_m / 2],
            quat=_yaw(at[2]),
            size=[*half, top_m / 2],
            rgba=_WOOD,
            **self._solid(),
            **contact.WORLD,
        )

    def _frame(
        self, spec: mujoco.MjSpec, name: str, at: PlanarPose, top_m: float, half_m: float, depth_m: float
    ) -> None:
        """A square hole with a funnel, on a pedestal: each side a low inner wall, a slope and a high outer wall."""
        lead, rim = LEAD_M, half_m + LEAD_M
        self._block(spec, f"{name}_foot", at, (rim + RIM_M, rim + RIM_M), top_m - depth_m - lead)
        body = spec.worldbody.add_body(name=name, pos=[at[0], at[1], top_m], quat=_yaw(at[2]))
        solid = {**self._solid(), **contact.WORLD, "rgba": _BLUE, "type": mujoco.mjtGeom.mjGEOM_BOX}
        slope = np.array([math.cos(math.pi / 8), 0.0, -math.sin(math.pi / 8), 0.0])
        # The slope's plate lies under its face, which goes from the inner wall's top edge to the rim.
        thick = 0.25 * lead
        middle = np.array([half_m + lead / 2, -lead / 2]) + thick * math.sqrt(0.5) * np.array([1.0, -1.0])
        parts = (
            ("inner", half_m + lead / 2, -lead - depth_m / 2, (lead / 2, rim, depth_m / 2), None),
            ("lead", middle[0], middle[1], (lead * math.sqrt(0.5), rim, thick), slope),
            ("rim", rim + RIM_M / 2, -(lead + depth_m) / 2, (RIM_M / 2, rim + RIM_M, (lead + depth_m) / 2), None),
        )
        for k in range(4):
            turn = np.array(_yaw(k * math.pi / 2))
            c, s = math.cos(k * math.pi / 2), math.sin(k * math.pi / 2)
            for part, far, z, size, tilt in parts:
                quat = turn.copy()
                if tilt is not None:
                    mujoco.mju_mulQuat(quat, turn, tilt)
                body.add_geom(name=f"{name}_{part}{k}", pos=[far * c, far * s, z], quat=quat, size=size, **solid)

    def _add_box(self, spec: mujoco.MjSpec, kind: BoxKind) -> None:
        x, y, yaw = self.stand
        body = spec.worldbody.add_body(name=BOX, pos=[x, y, self.stand_m + kind.half[2] + 0.0005], quat=_yaw(yaw))
        body.add_freejoint(name=BOX)
        solid = {**self._solid(), **MOVABLE, "type": mujoco.mjtGeom.mjGEOM_BOX, "rgba": _RED}
        grip = {**solid, **GRIP, "rgba": _STEEL}
        part_kg, thick = 0.01 * kind.mass_kg, kind.bar_thick_m / 2
        body.add_geom(name="box", size=kind.half, mass=kind.mass_kg - 3 * part_kg, **solid)
        bar_z = kind.handle_m - kind.half[2]
        body.add_geom(name="box_bar", size=[thick, kind.bar_half_m, thick], pos=[0, 0, bar_z], mass=part_kg, **grip)
        for k, sign in enumerate((1.0, -1.0)):
            half_z = kind.gap_m / 2 + thick
            at = [0.0, sign * (kind.bar_half_m - 0.008), kind.half[2] + half_z]
            body.add_geom(name=f"box_post{k}", size=[thick, 0.008, half_z], pos=at, mass=part_kg, **solid)
        body.add_site(name="box_handle", pos=[0.0, 0.0, bar_z])

    def _add_plug(self, spec: mujoco.MjSpec, kind: PlugKind) -> None:
        x, y, yaw = self.rack
        body = spec.worldbody.add_body(name=PLUG, pos=[x, y, self.rack_m + 0.0005], quat=_yaw(yaw))
        body.add_freejoint(name=PLUG)
        solid = {**self._solid(), **MOVABLE, "type": mujoco.mjtGeom.mjGEOM_CYLINDER, "rgba": _STEEL}
        middle_m, ball_m = kind.grip_m / 2, 0.3 * kind.grip_m
        ball = {**solid, **GRIP, "type": mujoco.mjtGeom.mjGEOM_SPHERE, "mass": 0.4 * kind.mass_kg}
        for k, sign in enumerate((1.0, -1.0)):
            at = [0.0, 0.0, middle_m + sign * ball_m]
            body.add_geom(name=f"plug_grip{k}", size=[kind.grip_radius_m, 0, 0], pos=at, **ball)
        peg = {**solid, "rgba": _RED, "mass": 0.2 * kind.mass_kg}
        body.add_geom(name="plug_peg", size=[kind.peg_radius_m, kind.peg_m / 2, 0], pos=[0, 0, -kind.peg_m / 2], **peg)
        body.add_site(name="plug_handle", pos=[0.0, 0.0, kind.grip_m / 2])
        body.add_site(name="plug_tip", pos=[0.0, 0.0, -kind.peg_m])


def _yaw(yaw_rad: float) -> list[float]:
    return [math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)]


def handle_pose(plant: Plant, name: str) -> Pose:
    """Where the handle of ``BOX`` or ``PLUG`` truly is: y along the bar, z up."""
    return plant.site(f"{name}_handle")


def touching(plant: Plant, name: str) -> frozenset[str]:
    """Names of the bodies that now touch a thing: what physics says about who holds it."""
    model, data = plant.model, plant.data
    own, found = model.body(name).id, set()
    for a, b in data.contact.geom[: data.ncon]:
        bodies = (int(model.geom_bodyid[a]), int(model.geom_bodyid[b]))
        if own in bodies and bodies[0] != bodies[1]:
            other = bodies[0] if bodies[1] == own else bodies[1]
            geom = b if bodies[0] == own else a
            found.add(model.body(other).name if other else model.geom(int(geom)).name)
    return frozenset(found)
