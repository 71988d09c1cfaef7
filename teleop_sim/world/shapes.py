"""A compiled MuJoCo model as frames and solids, for viewers that know no MuJoCo.

Every joint becomes one frame; a body with several joints gets frames between. A body's pose in MuJoCo is its offset,
then its joints in their order, each a turn about its anchor or a move along its axis.

Source: MuJoCo documentation, *Computation: Kinematics*, and ``mj_kinematics`` (engine_core_smooth.c).

Not shown: textures, materials, gloss; planes beyond 6 m; what is in a group that MuJoCo's viewer hides. A free body
beside the robot's root stays where the model has it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from teleop_sim.core.views import WORLD, Colour, Frame, Quaternion, Solid, Vector

CAMERA = "camera"
"""Frame of the robot's camera: right, down, forward, as viewers want it."""

_ROOT = "root"
_SHOWN_GROUPS = 3
"""MuJoCo's viewer shows groups 0 to 2."""

_PLANE_M, _PLANE_THICK_M = 12.0, 0.01
"""A plane is shown as a plate of at most that size, for viewers that go back until they see all (assumed)."""

_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Columns right, down, forward, in forward, left, up."""


def frames_and_solids(model: mujoco.MjModel, camera: str) -> tuple[tuple[Frame, ...], tuple[Solid, ...]]:
    """All that a model holds, parents before children.

    Args:
        model: of robot and world.
        camera: site of the robot's camera; its frame is called ``CAMERA``.
    """
    names = [WORLD, *(model.body(i).name or f"body{i}" for i in range(1, model.nbody))]
    frames = tuple(frame for body in range(1, model.nbody) for frame in _frames(model, names, body))
    return (*frames, _camera(model, names, camera)), tuple(_solids(model, names))


def _frames(model: mujoco.MjModel, names: list[str], body: int) -> Iterator[Frame]:
    parent = names[model.body_parentid[body]]
    place = _vector(model.body_pos[body]), _quaternion(model.body_quat[body])
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    if count == 0:
        yield Frame(names[body], parent, *place)
    for joint in range(first, first + count):
        called = model.joint(joint).name
        last = joint == first + count - 1
        name = names[body] if last else f"{names[body]}.{called}"
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            yield Frame(name, parent, *place, kind="free" if called == _ROOT else "fixed")
            continue
        kind = _KINDS[int(model.jnt_type[joint])]
        yield Frame(
            name,
            parent,
            *place,
            "hinge" if kind == "hinge" else "slide",
            called,
            _vector(model.jnt_axis[joint]),
            _vector(model.jnt_pos[joint]),
            float(model.qpos0[model.jnt_qposadr[joint]]),
        )
        parent, place = name, (_vector(np.zeros(3)), _quaternion(np.array([1.0, 0.0, 0.0, 0.0])))


def _camera(model: mujoco.MjModel, names: list[str], site: str) -> Frame:
    """Upright, however the site is mounted: images are turned before anybody sees them."""
    number = int(model.site(site).id)
    body = int(model.site_bodyid[number])
    mounted = _matrix(model.site_quat[number])
    up, above = mounted, body
    while above:
        up, above = _matrix(model.body_quat[above]) @ up, int(model.body_parentid[above])
    if up[2, 2] < 0.0:
        mounted = mounted * np.array([1.0, -1.0, -1.0])
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, np.ascontiguousarray(mounted @ _OPTICAL).ravel())
    return Frame(CAMERA, names[body], _vector(model.site_pos[number]), _quaternion(turn))


def _solids(model: mujoco.MjModel, names: list[str]) -> Iterator[Solid]:
    for geom in range(model.ngeom):
        if model.geom_group[geom] < _SHOWN_GROUPS and model.geom_rgba[geom, 3] > 0.0:
            yield from _solid(model, geom, names[model.geom_bodyid[geom]])


def _solid(model: mujoco.MjModel, geom: int, frame: str) -> Iterator[Solid]:
    name = model.geom(geom).name or f"geom{geom}"
    at, turn, colour = model.geom_pos[geom], model.geom_quat[geom], _colour(model.geom_rgba[geom])
    place = _vector(at), _quaternion(turn)
    kind, (a, b, c) = mujoco.mjtGeom(int(model.geom_type[geom])), (float(v) for v in model.geom_size[geom])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        yield Solid(frame, name, "box", *place, (2 * a, 2 * b, 2 * c), colour)
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        yield Solid(frame, name, "sphere", *place, (2 * a, 2 * a, 2 * a), colour)
    elif kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        yield Solid(frame, name, "sphere", *place, (2 * a, 2 * b, 2 * c), colour)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        yield Solid(frame, name, "cylinder", *place, (2 * a, 2 * a, 2 * b), colour)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        yield Solid(frame, name, "cylinder", *place, (2 * a, 2 * a, 2 * b), colour)
        for end, sign in (("end0", -1.0), ("end1", 1.0)):
            middle = at + _matrix(turn) @ np.array([0.0, 0.0, sign * b])
            yield Solid(frame, f"{name}.{end}", "sphere", _vector(middle), place[1], (2 * a, 2 * a, 2 * a), colour)
    elif kind == mujoco.mjtGeom.mjGEOM_PLANE:
        across = [min(2 * half, _PLANE_M) if half > 0.0 else _PLANE_M for half in (a, b)]
        middle = at - _matrix(turn) @ np.array([0.0, 0.0, _PLANE_THICK_M / 2])
        size = (across[0], across[1], _PLANE_THICK_M)
        yield Solid(frame, name, "box", _vector(middle), place[1], size, colour)
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        yield _mesh(model, geom, Solid(frame, name, "mesh", *place, (0.0, 0.0, 0.0), colour))


def _mesh(model: mujoco.MjModel, geom: int, solid: Solid) -> Solid:
    mesh = int(model.geom_dataid[geom])
    vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
    points = model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]]
    faces = model.mesh_face[face : face + model.mesh_facenum[mesh]]
    size = _vector(2.0 * np.abs(points).max(axis=0))
    corners = tuple((int(i), int(j), int(k)) for i, j, k in faces)
    shape = tuple(_vector(p) for p in points)
    return Solid(solid.frame, solid.name, "mesh", solid.position_m, solid.rotation, size, solid.colour, shape, corners)


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quaternion, float))
    return matrix.reshape(3, 3)


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _quaternion(values: np.ndarray) -> Quaternion:
    w, x, y, z = (float(v) for v in values)
    length = math.sqrt(w * w + x * x + y * y + z * z)
    return w / length, x / length, y / length, z / length


def _colour(values: np.ndarray) -> Colour:
    # Four decimals hide that MuJoCo keeps colours in single precision.
    r, g, b, a = (round(float(v), 4) for v in values)
    return r, g, b, a
