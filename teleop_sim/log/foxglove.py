"""Views as messages of Foxglove's well-known schemas, with that project's own generated classes.

Viewers know these by the schemas' names: Foxglove, Lichtblick and Rerun show them without being told how. Motion, of
which there is most, is encoded faster in ``foxglove_motion.py``.

Source: docs.foxglove.dev/docs/sdk/schemas; the declarations are those of the package ``foxglove-schemas-protobuf``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf import descriptor_pb2, descriptor_pool
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp

from teleop_sim.core.views import CameraPicture, CloudShown, Frame, Lens, LogLine, SceneTree, Solid, View
from teleop_sim.log.urdf import urdf
from teleop_sim.log.wire import text, timestamp, whole

MOTION = "/tf"
"""Topic of the frames that move."""

STILL = "/tf_static"
"""Topic of the frames that do not: apart, because a viewer that jumps in time looks for the last message of a topic."""

MODEL = "/robot_description"
"""Topic of the URDF."""

FLOAT32_BYTES = 4


@dataclass(frozen=True)
class ViewTopic:
    """How one topic is declared: names of schema and its encoding, encoding of messages, declaration."""

    schema: str
    schema_encoding: str
    message_encoding: str
    data: bytes


_MESSAGES: dict[str, type[Message]] = {
    MOTION: FrameTransforms,
    STILL: FrameTransforms,
    "/scene": SceneUpdate,
    "/camera": CompressedImage,
    "/camera_info": CameraCalibration,
    "/cloud": PointCloud,
    "/log": Log,
}

VIEW_TOPICS = (*_MESSAGES, MODEL)
"""All topics that views can have. None is a record's."""


@cache
def view_topic(topic: str) -> ViewTopic:
    """How a topic is declared.

    Raises:
        KeyError: no view has this topic.

    """
    if topic == MODEL:
        # ROS 2's own string: what viewers take a robot's description from.
        return ViewTopic("std_msgs/msg/String", "ros2msg", "cdr", b"string data")
    declared = _MESSAGES[topic].DESCRIPTOR
    files: dict[str, descriptor_pb2.FileDescriptorProto] = {}
    _collect(declared.file.name, files)
    data = descriptor_pb2.FileDescriptorSet(file=files.values()).SerializeToString(deterministic=True)
    return ViewTopic(declared.full_name, "protobuf", "protobuf", data)


def _collect(name: str, files: dict[str, descriptor_pb2.FileDescriptorProto]) -> None:
    """A declaration after all that it needs, ``google/protobuf/timestamp.proto`` too."""
    proto = descriptor_pb2.FileDescriptorProto()
    descriptor_pool.Default().FindFileByName(name).CopyToProto(proto)
    for needed in proto.dependency:
        if needed not in files:
            _collect(needed, files)
    files[name] = proto


def encoded(view: View) -> list[tuple[str, bytes]]:
    """Topics and messages of a view; of a ``SceneTree`` all but what moves."""
    if isinstance(view, LogLine):
        return [("/log", _line(view))]
    if isinstance(view, SceneTree):
        return list(_scene(view))
    if isinstance(view, CameraPicture):
        picture = CompressedImage(timestamp=_time(view.t_s), frame_id=view.frame, format=view.media, data=view.data)
        return [("/camera", _bytes(picture))]
    if isinstance(view, Lens):
        return [("/camera_info", _bytes(_lens(view)))]
    return [("/cloud", _bytes(_cloud(view)))]


def _line(line: LogLine) -> bytes:
    """A ``foxglove.Log``: by hand, for there are hundreds in a run."""
    level = {"info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}[line.level]
    return timestamp(1, round(line.t_s * 1e9)) + whole(2, level) + text(3, line.text) + text(4, line.name)


def _lens(lens: Lens) -> CameraCalibration:
    f, cx, cy = lens.focal_px, lens.width_px / 2, lens.height_px / 2
    made = CameraCalibration(timestamp=_time(lens.t_s), frame_id=lens.frame)
    made.width, made.height = lens.width_px, lens.height_px
    made.K[:] = [f, 0, cx, 0, f, cy, 0, 0, 1]
    made.R[:] = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    made.P[:] = [f, 0, cx, 0, 0, f, cy, 0, 0, 0, 1, 0]
    return made


def _cloud(cloud: CloudShown) -> PointCloud:
    fields = [
        PackedElementField(name=name, offset=FLOAT32_BYTES * k, type=PackedElementField.FLOAT32)
        for k, name in enumerate("xyz")
    ]
    return PointCloud(
        timestamp=_time(cloud.t_s),
        frame_id=cloud.frame,
        pose=Pose(orientation=Quaternion(w=1.0)),
        point_stride=3 * FLOAT32_BYTES,
        fields=fields,
        data=cloud.points,
    )


@lru_cache(maxsize=2)
def _scene(tree: SceneTree) -> tuple[tuple[str, bytes], ...]:
    """Runs of a sweep share their scene."""
    update = SceneUpdate()
    for frame in dict.fromkeys(solid.frame for solid in tree.solids):
        # Locked to its frame, an entity moves with it and need not be sent again.
        entity = update.entities.add(timestamp=_time(tree.t_s), frame_id=frame, id=frame, frame_locked=True)
        for solid in tree.solids:
            if solid.frame == frame:
                _add(entity, solid)
    still = _still(tree.t_s, [frame for frame in tree.frames if frame.kind == "fixed"])
    words = urdf(tree).encode() + b"\0"
    # CDR, little endian: four bytes that say so, a length, the text and its closing zero.
    model = b"\x00\x01\x00\x00" + len(words).to_bytes(4, "little") + words
    return (STILL, _bytes(still)), ("/scene", _bytes(update)), (MODEL, model)


def _still(t_s: float, frames: Iterable[Frame]) -> FrameTransforms:
    made = FrameTransforms()
    for frame in frames:
        (x, y, z), (w, i, j, k) = frame.position_m, frame.rotation
        made.transforms.add(
            timestamp=_time(t_s),
            parent_frame_id=frame.parent,
            child_frame_id=frame.name,
            translation=Vector3(x=x, y=y, z=z),
            rotation=Quaternion(w=w, x=i, y=j, z=k),
        )
    return made


def _add(entity: SceneEntity, solid: Solid) -> None:
    if solid.kind == "mesh":
        shape = entity.triangles.add(pose=_pose(solid), color=_colour(solid))
        shape.points.extend(Point3(x=x, y=y, z=z) for x, y, z in solid.points_m)
        shape.indices[:] = [corner for face in solid.faces for corner in face]
        return
    x, y, z = solid.size_m
    size = Vector3(x=x, y=y, z=z)
    if solid.kind == "box":
        entity.cubes.add(pose=_pose(solid), size=size, color=_colour(solid))
    elif solid.kind == "sphere":
        entity.spheres.add(pose=_pose(solid), size=size, color=_colour(solid))
    else:
        entity.cylinders.add(pose=_pose(solid), size=size, color=_colour(solid), bottom_scale=1.0, top_scale=1.0)


def _pose(solid: Solid) -> Pose:
    x, y, z = solid.position_m
    w, i, j, k = solid.rotation
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(w=w, x=i, y=j, z=k))


def _colour(solid: Solid) -> Color:
    r, g, b, a = solid.colour
    return Color(r=r, g=g, b=b, a=a)


def _time(t_s: float) -> Timestamp:
    seconds, nanos = divmod(round(t_s * 1e9), 10**9)
    return Timestamp(seconds=seconds, nanos=nanos)


def _bytes(message: Message) -> bytes:
    return message.SerializeToString(deterministic=True)
