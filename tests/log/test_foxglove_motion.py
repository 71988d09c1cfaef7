"""Motion in the log against MuJoCo's own kinematics, and its fast encoding against protobuf's classes."""

from __future__ import annotations

from functools import partial

import mujoco
import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from hypothesis import given, settings
from hypothesis import strategies as st

from teleop_sim import load_scenario
from teleop_sim.core.records import PlantSample
from teleop_sim.core.streams import stream
from teleop_sim.core.views import Frame, SceneTree
from teleop_sim.log.foxglove import STILL, encoded
from teleop_sim.log.foxglove_motion import GRID, Motion
from teleop_sim.robot.perception.rays import upright
from teleop_sim.robot.robots import ROBOTS
from teleop_sim.scenarios.objects import TASKS
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.world.bench_scene import Bench
from teleop_sim.world.plant import Plant

TASK_SCENES = ("src-dish", "drc-door-day1", "drc-valve-lab-operator", "drc-door-thormang3-day1")
BENCHES = ("slide", "wheel", "screw", "rod")


def task_plant(name):
    scenario = load_scenario(name, {})
    site = TASKS[scenario.task].site(scenario, partial(stream, 3, 0))
    spec = robot_spec(scenario)
    return Plant(spec.model, site.scenery), spec.camera_frame


def bench_plant(thing):
    spec = ROBOTS["atlas"]()
    return Plant(spec.model, Bench(thing=thing)), spec.camera_frame


PLANTS = [pytest.param(partial(task_plant, name), id=name) for name in TASK_SCENES] + [
    pytest.param(partial(bench_plant, thing), id=thing) for thing in BENCHES
]


def samples_of(plant, count=5):
    """States with all joints and the root anywhere."""
    rng = np.random.default_rng(5)
    angles = rng.uniform(-7.0, 7.0, (count, len(plant.joint_names)))
    pelvis = rng.uniform(-30.0, 30.0, (count, 7))
    pelvis[:, 3:] /= np.linalg.norm(pelvis[:, 3:], axis=1, keepdims=True)
    return np.hstack([pelvis, angles])


def placed(transforms):
    """Frames in the world: name to (4, 4)."""
    local = {t.child_frame_id: (t.parent_frame_id, matrix(t)) for t in transforms}
    assert len(local) == len(transforms)

    def world(name):
        if name == "world":
            return np.eye(4)
        parent, pose = local[name]
        return world(parent) @ pose

    return {name: world(name) for name in local}


def matrix(transform):
    turn, at = transform.rotation, transform.translation
    pose, flat = np.eye(4), np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array([turn.w, turn.x, turn.y, turn.z]))
    pose[:3, :3], pose[:3, 3] = flat.reshape(3, 3), (at.x, at.y, at.z)
    return pose


@pytest.mark.parametrize("make", PLANTS)
def test_links_are_where_mujoco_has_them(make):
    plant, camera = make()
    tree, samples = plant.scene(0.0, "x", camera), samples_of(plant)
    still = FrameTransforms.FromString(dict(encoded(tree))[STILL])
    messages = Motion(tree).encode([10**9 * k for k in range(len(samples))], samples)
    for message, sample in zip(messages, samples, strict=True):
        frames = placed([*still.transforms, *FrameTransforms.FromString(bytes(message)).transforms])
        plant.data.qpos[:7] = sample[:7]
        for name, value in zip(plant.joint_names, sample[7:], strict=True):
            plant.set_angle(name, float(value))
        mujoco.mj_kinematics(plant.model, plant.data)
        for body in range(1, plant.model.nbody):
            there = frames[plant.model.body(body).name]
            # A dozen joints in a row, each half a step of 2^-20 off in two components of its quaternion, which turns
            # and stretches what follows, 1.5 m at most, by 2e-6. (On the way of a real run 4e-6 m at most.)
            assert there[:3, 3] == pytest.approx(plant.data.xpos[body], abs=4e-5)
            assert there[:3, :3].ravel() == pytest.approx(plant.data.xmat[body], abs=4e-5)


@pytest.mark.parametrize("make", PLANTS)
def test_shapes_are_where_mujoco_has_them(make):
    plant, camera = make()
    model, data, tree = plant.model, plant.data, plant.scene(0.0, "x", camera)
    mujoco.mj_kinematics(model, data)
    inside = {model.body(k).name: (data.xpos[k], data.xmat[k].reshape(3, 3)) for k in range(model.nbody)}
    geoms = {model.geom(k).name: k for k in range(model.ngeom)}
    shown = {}
    for solid in tree.solids:
        at, turn = inside[solid.frame]
        shown.setdefault(solid.name.split(".end")[0], []).append(at + turn @ np.array(solid.position_m))
    assert set(shown) <= set(geoms)
    assert len(shown) == sum(1 for k in range(model.ngeom) if model.geom_group[k] < 3)
    for name, middles in shown.items():
        # A capsule's two balls lie evenly about its middle; a plate for a plane lies just under it.
        middle, tolerance = np.mean(middles, axis=0), 0.0051 if model.geom_type[geoms[name]] == 0 else 1e-9
        assert middle == pytest.approx(data.geom_xpos[geoms[name]], abs=tolerance)


@pytest.mark.parametrize("make", PLANTS)
def test_the_camera_looks_where_its_pictures_were_taken(make):
    """Right, down and forward of the frame, against the pose that the camera itself uses."""
    plant, camera = make()
    tree = plant.scene(0.0, "x", camera)
    frame = next(f for f in tree.frames if f.name == "camera")
    plant.data.qpos[3:7] = 1.0, 0.0, 0.0, 0.0
    mujoco.mj_kinematics(plant.model, plant.data)
    body = plant.model.body(frame.parent).id
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array(frame.rotation))
    right, down, forward = (plant.data.xmat[body].reshape(3, 3) @ flat.reshape(3, 3)).T
    site = plant.site(camera)
    ahead, left, up = upright(site.rotation).T
    assert forward == pytest.approx(ahead, abs=1e-9)
    assert right == pytest.approx(-left, abs=1e-9)
    assert down == pytest.approx(-up, abs=1e-9)
    at = plant.data.xpos[body] + plant.data.xmat[body].reshape(3, 3) @ np.array(frame.position_m)
    assert at == pytest.approx(site.position, abs=1e-9)


units = st.floats(-1.0, 1.0)
whole_turns = st.tuples(units, units, units, units).filter(lambda q: np.linalg.norm(q) > 0.1)


@st.composite
def frames(draw):
    """A chain of joints with awkward names and places."""
    made = [Frame("pelvis", "world", kind="free")]
    for k in range(draw(st.integers(1, 4))):
        turn = np.array(draw(whole_turns))
        axis = np.array(draw(st.tuples(units, units, units).filter(lambda a: np.linalg.norm(a) > 0.1)))
        kind = draw(st.sampled_from(("hinge", "slide")))
        place = draw(st.sampled_from(((0.0, 0.0, 0.0), (0.1, -0.2, 0.3))))
        anchor = draw(st.sampled_from(((0.0, 0.0, 0.0), (0.05, 0.1, -0.2))))
        made.append(
            Frame(
                f"Glied {k} größer" + "x" * draw(st.sampled_from((0, 150))),
                made[-1].name,
                place,
                tuple((turn / np.linalg.norm(turn)).tolist()),
                kind,
                f"j{k}",
                tuple((axis / np.linalg.norm(axis)).tolist()),
                anchor,
                draw(st.sampled_from((0.0, 0.7))),
            )
        )
    return tuple(made)


def turn_of(axis, angle):
    w, x, y, z = np.cos(angle / 2), *(np.sin(angle / 2) * np.array(axis))
    return np.array([w, x, y, z])


def times(a, b):
    made = np.zeros(4)
    mujoco.mju_mulQuat(made, np.array(a), np.array(b))
    return made


def turned(rotation, vector):
    made = np.zeros(3)
    mujoco.mju_rotVecQuat(made, np.array(vector, float), np.array(rotation))
    return made


def official(chain, time_ns, sample):
    """The same message from the schema's own classes, a joint at a time."""
    message = FrameTransforms()
    for k, frame in enumerate(chain):
        if frame.kind == "free":
            at, turn = sample[:3], sample[3:7]
        else:
            by = sample[6 + k] - frame.zero
            at, turn = np.array(frame.position_m), np.array(frame.rotation)
            if frame.kind == "slide":
                at = at + turned(turn, by * np.array(frame.axis))
            else:
                new = times(turn, turn_of(frame.axis, by))
                at = at + turned(turn, frame.anchor_m) - turned(new, frame.anchor_m)
                turn = new
        x, y, z = (float(v) for v in at)
        w, i, j, k_ = (float(v) for v in turn)
        message.transforms.add(
            timestamp=Timestamp(seconds=time_ns // 10**9, nanos=time_ns % 10**9),
            parent_frame_id=frame.parent,
            child_frame_id=frame.name,
            translation=Vector3(x=x, y=y, z=z),
            rotation=Quaternion(w=w, x=i, y=j, z=k_),
        )
    return message


def numbers(transform):
    t, r = transform.translation, transform.rotation
    return [t.x, t.y, t.z, r.x, r.y, r.z, r.w]


@settings(deadline=None, max_examples=150)
@given(frames(), st.lists(st.tuples(st.integers(0, 10**15), st.integers(0, 10**6)), min_size=1, max_size=4))
def test_the_fast_encoding_says_what_protobufs_own_says(chain, moments):
    joints = tuple(f"j{k}" for k in range(len(chain) - 1))
    motion = Motion(SceneTree(0.0, "x", chain, (), joints))
    rows = np.array([np.random.default_rng(seed).uniform(-5.0, 5.0, 7 + len(joints)) for _, seed in moments])
    rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
    times_ns = [time_ns for time_ns, _ in moments]
    for data, time_ns, row in zip(motion.encode(times_ns, rows), times_ns, rows, strict=True):
        message, wanted = FrameTransforms.FromString(bytes(data)), official(chain, time_ns, row)
        assert FrameTransforms.FromString(message.SerializeToString()) == message
        assert len(message.transforms) == len(wanted.transforms)
        for told, want in zip(message.transforms, wanted.transforms, strict=True):
            assert (told.timestamp, told.parent_frame_id) == (want.timestamp, want.parent_frame_id)
            assert told.child_frame_id == want.child_frame_id
            # Rounded to the grid: half a step, and the rounding of the sums.
            assert numbers(told) == pytest.approx(numbers(want), abs=0.51 / GRID)


def test_a_sample_of_another_scene_is_told_apart():
    motion = Motion(SceneTree(0.0, "x", (Frame("pelvis", "world", kind="free"),), (), ("a", "b")))
    assert motion.fits(PlantSample(0.0, (0.0,) * 7, (0.0, 0.0)))
    assert not motion.fits(PlantSample(0.0, (0.0,) * 7, (0.0,)))
    assert not motion.fits(PlantSample(0.0, (), (0.0, 0.0)))
