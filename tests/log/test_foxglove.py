"""Views as messages: declared so that anybody can decode them, saying what happened; kept when a log is cut short."""

from __future__ import annotations

import io
import math
import struct
import xml.etree.ElementTree as ET
from functools import partial

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.timestamp_pb2 import Timestamp
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from PIL import Image

from teleop_sim import load_scenario
from teleop_sim.channel.messages import MESSAGES, HandCloud, VoxelCloud, WebpImage
from teleop_sim.channel.messages import Image as GreyJpeg
from teleop_sim.core.records import RECORDS, PacketEnded, PlantNames, PlantSample, RunEnded, RunStarted, Scored
from teleop_sim.core.streams import stream
from teleop_sim.core.views import CameraPicture, CloudShown, Frame, Lens, LogLine, SceneTree, Solid
from teleop_sim.log.foxglove import MODEL, MOTION, STILL, VIEW_TOPICS, encoded, view_topic
from teleop_sim.log.foxglove_lines import line_of
from teleop_sim.log.load import load
from teleop_sim.log.schema import field_types
from teleop_sim.log.urdf import urdf
from teleop_sim.log.writer import LogWriter
from teleop_sim.robot.perception.camera import project
from teleop_sim.robot.perception.rays import SensorPose
from teleop_sim.run import run_scenario
from teleop_sim.scenarios.objects import TASKS
from teleop_sim.scenarios.robots import robot_spec
from teleop_sim.shown import Onlooker
from teleop_sim.world.plant import Plant

CLASSES = {
    MOTION: FrameTransforms,
    STILL: FrameTransforms,
    "/scene": SceneUpdate,
    "/camera": CompressedImage,
    "/camera_info": CameraCalibration,
    "/cloud": PointCloud,
    "/log": Log,
}
FRAMES = (
    Frame("pelvis", "world", kind="free"),
    Frame("arm", "pelvis", (0.1, 0.2, 0.3), (0.6, 0.8, 0.0, 0.0), "hinge", "elbow", (0.0, 1.0, 0.0)),
    Frame("hand", "arm", (0.0, 0.0, 0.4), (0.5, 0.5, -0.5, 0.5)),
)
SOLIDS = (
    Solid("world", "floor", "box", (0.0, 0.0, -0.1), (1.0, 0.0, 0.0, 0.0), (5.0, 4.0, 0.2), (0.1, 0.2, 0.3, 1.0)),
    Solid("arm", "bone", "cylinder", (0.0, 0.0, 0.2), (1.0, 0.0, 0.0, 0.0), (0.1, 0.1, 0.4), (1.0, 0.0, 0.0, 1.0)),
    Solid("arm", "stone", "sphere", (0.0, 0.0, 0.2), (1.0, 0.0, 0.0, 0.0), (0.1, 0.2, 0.4), (1.0, 0.0, 0.0, 1.0)),
    Solid(
        "hand",
        "wedge",
        "mesh",
        (0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0),
        (2.0, 2.0, 2.0),
        (0.0, 1.0, 0.0, 0.5),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)),
    ),
)
TREE = SceneTree(0.0, "robot & world", FRAMES, SOLIDS, ("elbow", "idle"))


@pytest.mark.parametrize("topic", CLASSES)
def test_a_declaration_stands_alone(topic):
    """Decoded with nothing but the bytes in the file: what it needs comes before it."""
    declared = view_topic(topic)
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(declared.data).file:
        pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName(declared.schema))
    assert declared.schema == CLASSES[topic].DESCRIPTOR.full_name
    assert made.FromString(CLASSES[topic]().SerializeToString()).SerializeToString() == b""
    assert set(CLASSES) | {MODEL} == set(VIEW_TOPICS)
    assert not set(VIEW_TOPICS) & set(RECORDS)


@given(st.floats(0.0, 1e7), st.sampled_from(("info", "warning", "error")), st.text(), st.text())
def test_lines_are_those_of_protobufs_own_class(t_s, level, name, text):
    ((topic, data),) = encoded(LogLine(t_s, level, name, text))
    seconds, nanos = divmod(round(t_s * 1e9), 10**9)
    wanted = Log(timestamp=Timestamp(seconds=seconds, nanos=nanos), message=text, name=name)
    wanted.level = {"info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}[level]
    assert topic == "/log"
    assert Log.FromString(data) == wanted


VALUES = {
    float: st.floats(),
    int: st.integers(-(2**63), 2**63 - 1),
    bool: st.booleans(),
    str: st.text(max_size=5),
    tuple[float, ...]: st.lists(st.floats(), max_size=3).map(tuple),
}


@pytest.mark.parametrize("topic", sorted(RECORDS))
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_any_record_has_a_line_or_none(topic, data):
    hints = field_types(RECORDS[topic])
    values = {name: data.draw(VALUES[hint]) for name, hint in hints.items() if name != "t_s"}
    line = line_of(RECORDS[topic](t_s=1.0, **values))
    assert line is None or (line.level in ("info", "warning", "error") and line.name is not None)


def test_what_went_wrong_is_said_as_such():
    """Levels: viewers filter and colour by them."""
    lost = PacketEnded(9.0, "up", 1, "chat", 5, 40, 1.0, 1.0, math.nan, 0, 0, 0, 0, "dropped", "loss", "")
    told = {line_of(lost), line_of(RunEnded(9.0, "failed", "fell", math.nan, 0, 0)), line_of(Scored(9.0, 1, "there"))}
    assert {(line.level, line.name, line.text) for line in told} == {
        ("warning", "link up", "chat dropped: loss"),
        ("error", "run", "failed after 9.0 s: fell"),
        ("info", "task", "there"),
    }
    arrived = PacketEnded(9.0, "up", 1, "chat", 5, 40, 1.0, 1.0, 2.0, 0, 0, 0, 0, "delivered", "", "")
    assert line_of(arrived) is None


def test_a_scene_has_all_solids_on_their_frames():
    messages = dict(encoded(TREE))
    scene = SceneUpdate.FromString(messages["/scene"])
    assert [(e.id, e.frame_id, e.frame_locked) for e in scene.entities] == [
        (n, n, True) for n in ("world", "arm", "hand")
    ]
    floor, arm, hand = scene.entities
    assert (floor.cubes[0].size.x, floor.cubes[0].pose.position.z) == (5.0, -0.1)
    assert (arm.cylinders[0].top_scale, arm.cylinders[0].bottom_scale) == (1.0, 1.0)
    assert (arm.spheres[0].size.x, arm.spheres[0].size.y, arm.spheres[0].size.z) == (0.1, 0.2, 0.4)
    assert len(hand.triangles[0].points) == 4
    assert list(hand.triangles[0].indices) == [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
    still = FrameTransforms.FromString(messages[STILL])
    assert [t.child_frame_id for t in still.transforms] == ["hand"]


def test_the_urdf_is_one_that_others_read():
    """CDR round it; a name with a sign that XML escapes; shapes of its own; a mesh as a box."""
    data = dict(encoded(TREE))[MODEL]
    assert data[:4] == b"\x00\x01\x00\x00"
    assert struct.unpack_from("<I", data, 4)[0] == len(data) - 8
    assert data.endswith(b"</robot>\n\x00")
    root = ET.fromstring(data[8:-1].decode())
    assert root.get("name") == "robot & world"
    assert [link.get("name") for link in root.findall("link")] == ["world", "pelvis", "arm", "hand"]
    shapes = [(v.get("name"), v.find("geometry")[0].tag) for v in root.iter("visual")]
    assert shapes == [("floor", "box"), ("bone", "cylinder"), ("stone", "sphere"), ("wedge", "box")]
    # The ball of the same volume.
    radius = float(root.find(".//visual[@name='stone']/geometry/sphere").get("radius"))
    assert (2 * radius) ** 3 == pytest.approx(0.1 * 0.2 * 0.4)


@pytest.mark.parametrize("name", ["src-dish", "drc-door-day1", "drc-valve-lab-operator"])
def test_pinocchio_finds_the_links_where_the_frames_are(name):
    """An independent reader of URDF, with all joints anywhere, against MuJoCo."""
    scenario = load_scenario(name, {})
    spec = robot_spec(scenario)
    plant = Plant(spec.model, TASKS[scenario.task].site(scenario, partial(stream, 3, 0)).scenery)
    model = pin.buildModelFromXML(urdf(plant.scene(0.0, name, spec.camera_frame)))
    data, place = model.createData(), pin.neutral(model)
    rng = np.random.default_rng(8)
    for joint in plant.joint_names:
        value = rng.uniform(-3.0, 3.0)
        plant.set_angle(joint, value)
        there = model.joints[model.getJointId(joint)]
        # What turns without limit is kept as cosine and sine.
        place[there.idx_q : there.idx_q + there.nq] = (math.cos(value), math.sin(value)) if there.nq == 2 else value
    mujoco.mj_kinematics(plant.model, plant.data)
    pin.framesForwardKinematics(model, data, place)
    for body in range(1, plant.model.nbody):
        found = data.oMf[model.getFrameId(plant.model.body(body).name, pin.FrameType.BODY)]
        # Nine digits of metres and radians, a dozen joints in a row.
        assert found.translation == pytest.approx(plant.data.xpos[body], abs=1e-6)
        assert found.rotation.ravel() == pytest.approx(plant.data.xmat[body], abs=1e-6)


def test_pictures_and_clouds_are_what_crossed_the_link():
    shown = []
    onlooker = Onlooker(shown.append)
    for kind in MESSAGES.values():
        onlooker.arrived(kind.example().encode(), 3.0)
    by_kind = {kind: [v for v in shown if isinstance(v, kind)] for kind in (CameraPicture, CloudShown, Lens)}
    assert [p.media for p in by_kind[CameraPicture]] == ["jpeg", "webp"]
    assert [p.data for p in by_kind[CameraPicture]] == [GreyJpeg.example().coded, WebpImage.example().coded]
    clouds = [VoxelCloud.example().centres_m(), HandCloud.example().voxels.centres_m()]
    for cloud, centres in zip(by_kind[CloudShown], clouds, strict=True):
        ((_, data),) = encoded(cloud)
        message = PointCloud.FromString(data)
        points = np.frombuffer(message.data, np.float32).reshape(-1, message.point_stride // 4)
        # Single precision, a few metres from the origin.
        assert points == pytest.approx(centres, abs=1e-6)
        assert [(f.name, f.offset) for f in message.fields] == [("x", 0), ("y", 4), ("z", 8)]
        assert message.pose.orientation.w == 1.0
    assert len(by_kind[Lens]) == 1


def test_the_lens_puts_things_where_the_picture_has_them():
    shown = []
    Onlooker(shown.append).arrived(GreyJpeg.example().encode(), 3.0)
    lens = next(view for view in shown if isinstance(view, Lens))
    matrix = np.array(CameraCalibration.FromString(dict(encoded(lens))["/camera_info"]).K).reshape(3, 3)
    ahead_left_up = np.array([[2.0, 0.3, -0.2], [5.0, -1.0, 1.0]])
    optical = ahead_left_up[:, [1, 2, 0]] * [-1.0, -1.0, 1.0]
    pixels = optical @ matrix.T
    wanted = project(ahead_left_up, SensorPose(np.eye(3), np.zeros(3)), 320, 170)
    assert pixels[:, :2] / pixels[:, 2:] == pytest.approx(wanted)


@pytest.fixture(scope="module")
def dish(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dish")
    return run_scenario(load_scenario("src-dish", {"time_limit_s": 60.0}), 1, folder).log


def read(path):
    with path.open("rb") as stream_:
        return [(c.topic, m.log_time, m.data) for _, c, m in make_reader(stream_).iter_messages()]


def test_a_run_shows_each_picture_when_it_arrived(dish):
    packets = [
        r
        for r in load(dish).records("link/packet")
        if (r.direction, r.topic, r.outcome) == ("down", "image", "delivered")
    ]
    pictures = [(at, CompressedImage.FromString(data)) for topic, at, data in read(dish) if topic == "/camera"]
    assert len(pictures) == len(packets) > 0
    for packet, (at, picture) in zip(packets, pictures, strict=True):
        assert at == round(packet.arrived_s * 1e9)
        assert len(picture.data) == packet.payload_bytes - 1
        assert Image.open(io.BytesIO(picture.data)).size == (320, 170)


def test_a_run_tells_its_story_in_lines(dish):
    lines = [Log.FromString(data) for topic, _, data in read(dish) if topic == "/log"]
    told = [line_of(record) for record in load(dish).records()]
    assert [line.message for line in lines] == [line.text for line in told if line is not None]
    assert {"run", "machine", "robot"} <= {line.name for line in lines}
    assert sum(line.level == Log.WARNING for line in lines) < len(lines) / 2


def test_motion_is_there_for_every_sample(dish):
    found = read(dish)
    samples = [at for topic, at, _ in found if topic == "field/plant"]
    assert [at for topic, at, _ in found if topic == MOTION] == samples
    assert [topic for topic, _, _ in found].count("/scene") == 1
    assert all(at == 0 for topic, at, _ in found if topic in ("/scene", STILL, MODEL))


def story(n=60):
    """Records and views in turn: chunks end by time, so that a cut falls between some."""
    yield RunStarted(0.0, "src-dish", "schema = 1\n", 1, 0, 1800.0, "teleop-sim 0.1.0")
    yield TREE
    yield PlantNames(0.0, "elbow idle")
    for k in range(n):
        yield PlantSample(2.0 * k, (float(k),) * 3 + (1.0, 0.0, 0.0, 0.0), (0.1 * k, 0.0))
        yield LogLine(2.0 * k, "info", "run", f"line {k}")
        yield CameraPicture(2.0 * k, "camera", "jpeg", bytes([k]) * 50)
    yield RunEnded(200.0, "completed", "", 99.5, 3, 7)


def tell(log, part):
    if isinstance(part, (SceneTree, LogLine, CameraPicture)):
        log.show(part)
    else:
        log(part)


class Stops:
    """A file that is interrupted in the middle of its n-th write."""

    def __init__(self, stream_, n):
        self.stream, self.n = stream_, n

    def write(self, data):
        self.n -= 1
        if self.n == 0:
            self.stream.write(data[: len(data) // 2])
            raise KeyboardInterrupt
        return self.stream.write(data)

    def __getattr__(self, name):
        return getattr(self.stream, name)


@pytest.mark.parametrize("n", range(1, 12))
def test_an_interruption_loses_no_view(tmp_path, n):
    whole = LogWriter(tmp_path / "whole.mcap")
    cut = LogWriter(tmp_path / "cut.mcap")
    cut._mcap.stream = Stops(cut._stream, n)
    try:
        for part in story():
            tell(whole, part)
            tell(cut, part)
        cut.close()
    except KeyboardInterrupt:
        cut.interrupt()
    whole.close()
    assert read(tmp_path / "cut.mcap") == read(tmp_path / "whole.mcap")
    with (tmp_path / "cut.mcap").open("rb") as stream_:
        numbers = [m.sequence for _, _, m in make_reader(stream_).iter_messages(log_time_order=False)]
    assert numbers == list(range(1, len(numbers) + 1))


def test_same_views_same_bytes_and_the_records_are_the_same_without_them(tmp_path):
    for name, keep in (("a", True), ("b", True), ("bare", False)):
        with LogWriter(tmp_path / f"{name}.mcap") as log:
            for part in story():
                if keep or not isinstance(part, (SceneTree, LogLine, CameraPicture)):
                    tell(log, part)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
    assert list(load(tmp_path / "a.mcap").records()) == list(load(tmp_path / "bare.mcap").records())
    assert not {topic for topic, _, _ in read(tmp_path / "bare.mcap")} & set(VIEW_TOPICS)
    bare = (tmp_path / "bare.mcap").read_bytes()
    assert b"foxglove" not in bare


def test_nothing_is_shown_in_a_finished_log(tmp_path):
    log = LogWriter(tmp_path / "run.mcap")
    log.close()
    with pytest.raises(ValueError, match="finished"):
        log.show(LogLine(0.0, "info", "run", "late"))
