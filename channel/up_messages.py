"""What the operator can say to the field site."""

from __future__ import annotations

from typing import ClassVar, Self

from teleop_sim.channel.codec import BadMessage, line_bytes, line_text
from teleop_sim.channel.message import LEVEL_MAX, UINT16_MAX, Counts, Message, message


@message("up", "confirm", b"\x01")
class Confirm(Counts):
    """The operator lets the suggested transition of a request pass."""

    layout: ClassVar = "type, request (2)"
    limits: ClassVar = (UINT16_MAX,)
    request: int


@message("up", "reject", b"\x02")
class Reject(Counts):
    """The operator refuses the suggested transition of a request."""

    layout: ClassVar = "type, request (2)"
    limits: ClassVar = (UINT16_MAX,)
    request: int


@message("up", "set_level", b"\x03")
class SetLevel(Counts):
    """The operator sets the autonomy level, 0 (Off) to 3 (Full)."""

    layout: ClassVar = "type, level"
    limits: ClassVar = (LEVEL_MAX,)
    level: int


@message("up", "stop_all", b"\x04")
class StopAll(Counts):
    """The operator stops the robot. One byte, as Team ZARJ's stop (ZarjRobotics/srcsim2017, zarjcomm/message.py)."""

    layout: ClassVar = "type"
    source: ClassVar = "ZARJ, message.py"


@message("up", "chat", b"/*&|_$")
class Chat(Message):
    """A line of WPI's chat vocabulary, see ``vocabulary.py``. Sent as ASCII with a line end: ``len(text) + 1`` bytes.

    Source of the size: WPI-Humanoid-Robotics-Lab/SpaceRoboticsChallenge @ea36ad7,
    src_bringup/scripts/message_parser.py.
    """

    layout: ClassVar = "ASCII line, line feed"
    source: ClassVar = "WPI, message_parser.py"

    text: str

    @classmethod
    def example(cls) -> Self:
        """WPI's command to look for the handles again."""
        return cls("/REDETECT_HANDLES_FROM_ERROR")

    def encode(self) -> bytes:
        """The line and its end."""
        line = line_bytes(self.text, "ascii", self.topic)
        if line[:1] not in self.marks:
            marks = " ".join(self.marks.decode())
            raise BadMessage(self.topic, f"{self.text!r} is no command", f"A command starts with one of {marks}")
        return line + b"\n"

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        if not payload.endswith(b"\n"):
            raise BadMessage(cls.topic, f"no line end in {payload!r}", "A chat line ends with one line feed.")
        return cls(line_text(payload[:-1], "ascii", cls.topic))
