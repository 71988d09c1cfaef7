"""What the operator can say to the field site."""

from __future__ import annotations

from typing import ClassVar, Self

from teleop_sim.channel.codec import BadMessage, line_bytes, line_text
from teleop_sim.channel.message import LEVEL_MAX, UINT16_MAX, UINT32_MAX, Counts, Message, Number, Sized, message


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


@message("up", "lock", b"\x80")
class Lock(Number):
    """No outcome of this state or container, by its number, may be taken until it is unlocked."""

    layout: ClassVar = "type, node (1, above 255 2)"
    node: int


@message("up", "unlock", b"\x81")
class Unlock(Number):
    """The lock of this state or container, by its number, ends."""

    layout: ClassVar = "type, node (1, above 255 2)"
    node: int


@message("up", "pause", b"\x82")
class Pause(Counts):
    """The machine rests: nothing works and nothing passes."""

    layout: ClassVar = "type"


@message("up", "resume", b"\x83")
class Resume(Counts):
    """The machine goes on after a pause."""

    layout: ClassVar = "type"


@message("up", "preempt", b"\x84")
class Preempt(Counts):
    """The machine ends, and the robot comes to rest."""

    layout: ClassVar = "type"


@message("up", "attach", b"\x85")
class Attach(Counts):
    """A control station joins with the machine of this checksum and asks for the whole state."""

    layout: ClassVar = "type, checksum of the machine (4)"
    limits: ClassVar = (UINT32_MAX,)
    behaviour: int


@message("up", "sync_request", b"\x86")
class SyncRequest(Counts):
    """The control station's mirror is out of step and asks for the whole state."""

    layout: ClassVar = "type"


@message("up", "ask_view", b"\x8f")
class AskView(Counts):
    """The operator wants to see how things are now: a picture (0). It is taken when the robot has come to rest."""

    layout: ClassVar = "type, what"
    limits: ClassVar = (0,)
    what: int


@message("up", "take_over", b"\x87")
class TakeOver(Number):
    """The operator acts in lieu of a state, by its number."""

    layout: ClassVar = "type, node (1, above 255 2)"
    node: int


@message("up", "hand_back", b"\x88")
class HandBack(Counts):
    """The operator has acted in lieu of a state and lets it begin anew; ``request`` is the one of kind ``act``."""

    layout: ClassVar = "type, request (2)"
    limits: ClassVar = (UINT16_MAX,)
    request: int


@message("up", "answer", b"\x89")
class Answer(Sized):
    """The data that a request of kind ``data`` asked for; what the bytes mean is between operator and program."""

    layout: ClassVar = "type, request (2), count n (2), data (n)"
    limits: ClassVar = (UINT16_MAX,)
    request: int
    data: bytes

    @classmethod
    def example(cls) -> Self:
        """A pose of twelve bytes."""
        return cls(1, bytes(12))


@message("up", "modify", b"\x8a")
class Modify(Sized):
    """A change of the machine that runs, packed by ``machines/``; it names the checksum that it was made for."""

    layout: ClassVar = "type, count n (2), patch (n)"
    data: bytes

    @classmethod
    def example(cls) -> Self:
        """A changed threshold."""
        return cls(bytes(40))


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
