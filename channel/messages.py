"""The messages that cross the link, with their real encoding: the list, and bytes to message and back.

The first byte says what a message is, so the payload alone decodes; the topic is a label for logs and counters.
Binary messages start with a type byte below 0x20 or from 0x80 on. Text lines need none: a chat line starts with one of
``/*&|_$``, a log line with a digit of its time. A new message is one class with ``@message`` in ``up_messages.py``,
``command_messages.py``, ``down_messages.py``, ``picture_messages.py``, ``mark_messages.py``, ``template_messages.py``,
``manipulation_messages.py`` or ``hand_messages.py``, and its name here.
"""

from __future__ import annotations

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.command_messages import (
    JOINT_GROUPS,
    SIDES,
    CartesianTarget,
    FootstepGoal,
    Force,
    JointGroup,
    JointTargets,
    Side,
    TemplatePose,
    WalkCommand,
)
from teleop_sim.channel.down_messages import (
    HANDLES,
    REQUEST_KINDS,
    HandleName,
    HandlePose,
    JointState,
    LevelIs,
    LockedIs,
    LogLine,
    MirrorUpdate,
    ModeIs,
    PausedIs,
    Request,
    RequestKind,
    SyncHash,
    SyncState,
    Withdrawn,
)
from teleop_sim.channel.hand_messages import HandCloud, encode_hand
from teleop_sim.channel.manipulation_messages import (
    OUTCOMES,
    STEPS,
    AskCloud,
    FootstepPlan,
    HandPose,
    OutcomeName,
    ResetWorld,
    StepDone,
    StepName,
    TemplateStep,
)
from teleop_sim.channel.mark_messages import MARK_NAMES, Marks, PixelMark
from teleop_sim.channel.message import LEVEL_MAX, MESSAGES, DirectionName, Message
from teleop_sim.channel.picture_messages import (
    Image,
    VoxelCloud,
    WebpImage,
    encode_image,
    encode_voxels,
    encode_webp,
)
from teleop_sim.channel.template_messages import (
    TemplateAttach,
    TemplateDetach,
    TemplateHash,
    TemplateInsert,
    TemplateMove,
    TemplateRemove,
    TemplateState,
    TemplateSync,
)
from teleop_sim.channel.up_messages import (
    Answer,
    AskView,
    Attach,
    Chat,
    Confirm,
    HandBack,
    Lock,
    Modify,
    Pause,
    Preempt,
    Reject,
    Resume,
    SetLevel,
    StopAll,
    SyncRequest,
    TakeOver,
    Unlock,
)
from teleop_sim.core.errors import UnknownName
from teleop_sim.core.records import MODES

__all__ = [
    "HANDLES",
    "JOINT_GROUPS",
    "LEVEL_MAX",
    "MARK_NAMES",
    "MESSAGES",
    "MODES",
    "OUTCOMES",
    "REQUEST_KINDS",
    "SIDES",
    "STEPS",
    "Answer",
    "AskCloud",
    "AskView",
    "Attach",
    "BadMessage",
    "CartesianTarget",
    "Chat",
    "Confirm",
    "DirectionName",
    "FootstepGoal",
    "FootstepPlan",
    "Force",
    "HandBack",
    "HandCloud",
    "HandPose",
    "HandleName",
    "HandlePose",
    "Image",
    "JointGroup",
    "JointState",
    "JointTargets",
    "LevelIs",
    "Lock",
    "LockedIs",
    "LogLine",
    "Marks",
    "Message",
    "MirrorUpdate",
    "ModeIs",
    "Modify",
    "OutcomeName",
    "Pause",
    "PausedIs",
    "PixelMark",
    "Preempt",
    "Reject",
    "Request",
    "RequestKind",
    "ResetWorld",
    "Resume",
    "SetLevel",
    "Side",
    "StepDone",
    "StepName",
    "StopAll",
    "SyncHash",
    "SyncRequest",
    "SyncState",
    "TakeOver",
    "TemplateAttach",
    "TemplateDetach",
    "TemplateHash",
    "TemplateInsert",
    "TemplateMove",
    "TemplatePose",
    "TemplateRemove",
    "TemplateState",
    "TemplateStep",
    "TemplateSync",
    "Unlock",
    "VoxelCloud",
    "WalkCommand",
    "WebpImage",
    "Withdrawn",
    "decode_message",
    "decode_payload",
    "encode_hand",
    "encode_image",
    "encode_message",
    "encode_voxels",
    "encode_webp",
]


def encode_message(m: Message) -> tuple[str, bytes]:
    """Topic and payload, as ``Direction.send`` takes them."""
    return m.topic, m.encode()


def decode_message(topic: str, payload: bytes) -> Message:
    """The message that ``payload`` holds, when ``topic`` says the same.

    Raises:
        UnknownName: no such topic.
        BadMessage: bytes that are no such message.

    """
    if topic not in MESSAGES:
        raise UnknownName("topic", topic, tuple(MESSAGES))
    return MESSAGES[topic].decode(payload)


def decode_payload(payload: bytes) -> Message:
    """The message that ``payload`` holds, told by its first byte alone.

    Raises:
        BadMessage: bytes that are no message.

    """
    kind = _KINDS.get(payload[:1])
    if kind is not None:
        return kind.decode(payload)
    raise BadMessage("payload", f"{len(payload)} bytes that start with {payload[:1].hex() or 'nothing'}", "No message.")


_KINDS = {bytes([mark]): kind for kind in MESSAGES.values() for mark in kind.marks}
