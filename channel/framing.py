"""Framing: what surrounds a message on its way, and how a long one is cut. See docs/link.md.

A direction charges the headers of every fragment. What a connection costs besides (a handshake, acknowledgements) the
delivery ``tcp`` really sends, with headers of its own: its direction has only those of layers below IP. The framings
``tcp_ip`` here are for traffic whose connection is not modelled.

Sources of the sizes: IPv4 header 20 bytes without options (RFC 791), UDP 8 (RFC 768), TCP 20 without options
(RFC 9293), TCP time stamps 12 with padding (RFC 7323, appendix A), Ethernet's greatest IP packet 1500 (RFC 894).
Measured by JSK at the DRC Finals, with the Ethernet header: 66 bytes for TCP/IP (14 + 20 + 32), 36 for UDP/IP.
"""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.core.errors import BadInput, Problem


@dataclass(frozen=True, slots=True)
class Framing:
    """Headers and the greatest fragment.

    Attributes:
        header_bytes: added to every fragment.
        mtu_bytes: greatest fragment with its header; 0: messages are never cut.

    Not modelled: IP's own fragmentation (a message that is too long is several datagrams or segments, each with the
    whole header), headers of the layers below IP unless ``header_bytes`` counts them.

    Raises:
        BadInput: with all numbers that are not whole or below zero, or an MTU that leaves no room behind the header.

    """

    header_bytes: int
    mtu_bytes: int = 0

    def __post_init__(self) -> None:
        found = [
            Problem(name, f"{value!r} cannot be used", "Give a whole number, zero or more.")
            for name, value in (("header_bytes", self.header_bytes), ("mtu_bytes", self.mtu_bytes))
            if not isinstance(value, int) or value < 0
        ]
        if not found and 0 < self.mtu_bytes <= self.header_bytes:
            what = f"{self.mtu_bytes} bytes hold no payload behind a header of {self.header_bytes}"
            found.append(Problem("mtu_bytes", what, f"Give {self.header_bytes + 1} or more, or 0 for no limit."))
        if found:
            raise BadInput(tuple(found))

    def fragments(self, payload_bytes: int) -> tuple[int, ...]:
        """Size of each fragment of a message, with its header [bits], in the order of sending.

        All are full but the last. A message without payload is one bare header.
        """
        room_bytes = self.mtu_bytes - self.header_bytes
        if self.mtu_bytes == 0 or payload_bytes <= room_bytes:
            return (8 * (payload_bytes + self.header_bytes),)
        full, rest_bytes = divmod(payload_bytes, room_bytes)
        tail = (8 * (rest_bytes + self.header_bytes),) if rest_bytes else ()
        return (8 * self.mtu_bytes,) * full + tail


FRAMINGS: dict[str, Framing] = {
    # Only the bytes of the message.
    "raw": Framing(0),
    "udp_ip": Framing(28, mtu_bytes=1500),
    "tcp_ip": Framing(40, mtu_bytes=1500),
    # With time stamps in every segment, as common systems send them.
    "tcp_ip_timestamps": Framing(52, mtu_bytes=1500),
    # A line over a connection that was opened before the run (assumed); its line end is part of the payload.
    "chat": Framing(40, mtu_bytes=1500),
}
