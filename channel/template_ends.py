"""The two template servers with what they say to each other. Neither knows a clock: the time of an arrival is told.

The control station tells its changes at once. It compares the field site's heartbeat with its own hash; when they
differ, and nothing of its own can still be under way, it sends all that it holds and gets all that the field site then
holds. So after a link that lost, doubled or reordered anything has returned, both hold the same within one heartbeat
and two and a half round trips (``tests/templates/test_template_link.py``).
"""

from __future__ import annotations

from teleop_sim.channel.command_messages import Side
from teleop_sim.channel.template_messages import (
    TemplateChange,
    TemplateHash,
    TemplateMessage,
    TemplateState,
    TemplateSync,
    change_message,
    state_message,
    whole_sync,
)
from teleop_sim.templates.poses import Pose
from teleop_sim.templates.server import Server


class StationTemplates:
    """The control station's server.

    Args:
        round_trip_s: announced: for so long after a change or a question a heartbeat may be older than it.

    Attributes:
        server: what is shown here.
        in_step: the last heartbeat told the same.

    """

    def __init__(self, round_trip_s: float) -> None:
        self.server, self.in_step = Server("station"), True
        self._round_trip_s, self._quiet_s = round_trip_s, 0.0

    def insert(self, template: int, pose: Pose, now_s: float) -> TemplateChange:
        """Put a new instance in the odometry frame; its number is in the message, which is to be sent."""
        self.server, entry = self.server.insert(template, pose)
        return self._told(now_s, change_message("insert", entry))

    def move(self, instance: int, pose: Pose, now_s: float) -> TemplateChange:
        """Align an instance anew."""
        self.server, entry = self.server.move(instance, pose)
        return self._told(now_s, change_message("move", entry))

    def attach(self, instance: int, hand: Side, pose: Pose, now_s: float) -> TemplateChange:
        """Fix an instance to a hand, by its pose in the hand's frame."""
        self.server, entry = self.server.attach(instance, hand, pose)
        return self._told(now_s, change_message("attach", entry))

    def detach(self, instance: int, pose: Pose, now_s: float) -> TemplateChange:
        """Let it be where it is."""
        self.server, entry = self.server.detach(instance, pose)
        return self._told(now_s, change_message("detach", entry))

    def remove(self, instance: int, now_s: float) -> TemplateChange:
        """Take it away."""
        self.server, entry = self.server.remove(instance)
        return self._told(now_s, change_message("remove", entry))

    def receive(self, message: TemplateState | TemplateHash, now_s: float) -> TemplateSync | None:
        """Take what the downlink delivered; what comes back is to be sent."""
        if isinstance(message, TemplateState):
            self.server = self.server.merge(message.entries)
            return None
        self.in_step = message.crc32 == self.server.hash
        if self.in_step or now_s < self._quiet_s:
            return None
        self._quiet_s = now_s + self._round_trip_s
        return whole_sync(self.server)

    def _told(self, now_s: float, message: TemplateChange) -> TemplateChange:
        self._quiet_s = now_s + self._round_trip_s
        return message


class FieldTemplates:
    """The field site's server.

    Attributes:
        server: what planning uses.

    """

    def __init__(self) -> None:
        self.server = Server("field")

    def receive(self, message: TemplateChange | TemplateSync) -> TemplateState | None:
        """Take what the uplink delivered; what comes back is to be sent."""
        self.server = self.server.merge(message.entries)
        return state_message(self.server.entries) if isinstance(message, TemplateSync) else None

    def heartbeat(self) -> TemplateHash:
        """To be sent now and then."""
        return TemplateHash(self.server.hash)

    def changed(self, server: Server) -> TemplateState:
        """Take a server that a behaviour has changed here; what comes back, the entries that are new, is to be sent."""
        old = set(self.server.entries)
        self.server = server
        return state_message([e for e in server.entries if e not in old])


def is_template(message: object) -> bool:
    """Whether a message is for one of these."""
    return isinstance(message, TemplateMessage)
