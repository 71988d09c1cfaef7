"""The messages that cross the link, with their real encoding: the list, and bytes to message and back.

The first byte says what a message is, so the payload alone decodes; the topic is a label for logs and counters.
Binary messages start with a type byte below 0x20. Text lines need none: a chat line starts with one of ``/*&|_$``,
a log line with a digit of its time. A new message is one class with ``@message`` in ``up_messages.py`` or
``down_messages.py``.
"""

from __future__ import annotations

from teleop_sim.channel.codec import BadMessage
from teleop_sim.channel.down_messages import (
    HANDLES,
    REQUEST_KINDS,
    HandleName,
    HandlePose,
    Image,
    LevelIs,
    LogLine,
    MirrorUpdate,
    ModeIs,
    Request,
    RequestKind,
    encode_image,
)
from teleop_sim.channel.message import LEVEL_MAX, MESSAGES, DirectionName, Message
from teleop_sim.channel.up_messages import Chat, Confirm, Reject, SetLevel, StopAll
from teleop_sim.core.errors import UnknownName
from teleop_sim.core.records import MODES

__all__ = [
    "HANDLES",
    "LEVEL_MAX",
    "MESSAGES",
    "MODES",
    "REQUEST_KINDS",
    "BadMessage",
    "Chat",
    "Confirm",
    "DirectionName",
    "HandleName",
    "HandlePose",
    "Image",
    "LevelIs",
    "LogLine",
    "Message",
    "MirrorUpdate",
    "ModeIs",
    "Reject",
    "Request",
    "RequestKind",
    "SetLevel",
    "StopAll",
    "decode_message",
    "decode_payload",
    "encode_image",
    "encode_message",
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
    for kind in MESSAGES.values():
        if payload[:1] and payload[:1] in kind.marks:
            return kind.decode(payload)
    raise BadMessage("payload", f"{len(payload)} bytes that start with {payload[:1].hex() or 'nothing'}", "No message.")
