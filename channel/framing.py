"""Framing: what surrounds a message on its way, and how a long one is cut. See docs/link.md.

A direction charges the headers of every fragment. What a connection costs besides (a handshake, acknowledgements) are
facts given here for whoever models the delivery; nothing here sends them.

Sources of the sizes: IPv4 header 20 bytes without options (RFC 791), UDP 8 (RFC 768), TCP 20 without options
(RFC 9293), TCP time stamps 12 with padding (RFC 7323, appendix A), Ethernet's greatest IP packet 1500 (RFC 894).
Measured by JSK at the DRC Finals, with the Ethernet header: 66 bytes for TCP/IP (14 + 20 + 32), 36 for UDP/IP.
"""

from __future__ import annotations

from dataclasses import dataclass

from teleop_sim.core.errors import BadInput, Problem


@dataclass(frozen=True, slots=True)
class Framing:
    """Headers, the greatest fragment, and what a connection costs.

    Attributes:
        header_bytes: added to every fragment.
        mtu_bytes: greatest fragment with its header; 0: messages are never cut.
        handshake_round_trips: to open a connection before the first data; each way a packet of ``header_bytes``.
        ack_bytes: acknowledgement of one fragment on the way back, headers included; 0: there is none.

    Not modelled: IP's own fragmentation (a message that is too long is several datagrams or segments, each with the
    whole header), options that only the handshake carries, acknowledgements delayed to every second segment (RFC 9293
    section 3.8.6.3 allows it), headers of the layers below IP unless ``header_bytes`` counts them, TCP's slow start.

    Raises:
        BadInput: with all numbers that are not whole or below zero, or an MTU that leaves no room behind the header.

    """

    header_bytes: int
    mtu_bytes: int = 0
    handshake_round_trips: int = 0
    ack_bytes: int = 0

    def __post_init__(self) -> None:
        names = ("header_bytes", "mtu_bytes", "handshake_round_trips", "ack_bytes")
        values = (self.header_bytes, self.mtu_bytes, self.handshake_round_trips, self.ack_bytes)
        found = [
            Problem(name, f"{value!r} cannot be used", "Give a whole number, zero or more.")
            for name, value in zip(names, values, strict=True)
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
    # Opened for the message: SYN and SYN+ACK are a round trip before data may follow (RFC 9293, section 3.5).
    "tcp_ip": Framing(40, mtu_bytes=1500, handshake_round_trips=1, ack_bytes=40),
    # With time stamps in every segment, as common systems send them; acknowledgement of 52 bytes.
    "tcp_ip_timestamps": Framing(52, mtu_bytes=1500, handshake_round_trips=1, ack_bytes=52),
    # A line over a connection that was opened before the run (assumed); its line end is part of the payload.
    "chat": Framing(40, mtu_bytes=1500, ack_bytes=40),
}
