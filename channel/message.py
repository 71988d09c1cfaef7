"""What every message is, the registry, and the base of messages made of small whole numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self, TypeVar, dataclass_transform

from teleop_sim.channel.codec import BadMessage, pack_counts, unpack_counts

DirectionName = Literal["up", "down"]

UINT8_MAX, UINT16_MAX, UINT32_MAX = 255, 65535, 4294967295
LEVEL_MAX = 3
"""Autonomy levels Off, Low, High, Full are 0 to 3."""


class Message(ABC):
    """Something that one site can say to the other. A value: frozen, equal when equal.

    Attributes:
        topic: label in logs.
        direction: of the link it is made for.
        marks: the first bytes that announce it; no two messages share one.
        layout: the bytes in order, for people; a number in brackets is a count of bytes, else one.
        resolution: of what comes back, for people.
        source: of the layout.
        packed: its size hangs on a compressor's build, so that an example's is about right only.

    """

    topic: ClassVar[str]
    direction: ClassVar[DirectionName]
    marks: ClassVar[bytes]
    layout: ClassVar[str]
    resolution: ClassVar[str] = "exact"
    source: ClassVar[str] = "own"
    packed: ClassVar[bool] = False
    __match_args__: ClassVar[tuple[str, ...]]

    @classmethod
    @abstractmethod
    def example(cls) -> Self:
        """A typical one, for the catalogue."""

    def __post_init__(self) -> None:
        """Refuse what could not be encoded.

        Raises:
            BadMessage: a field out of range.

        """
        self.encode()

    @abstractmethod
    def encode(self) -> bytes:
        """The payload: all bytes that the link is charged for, before headers.

        Raises:
            BadMessage: a field out of range; never of a message that was made.

        """

    @classmethod
    @abstractmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``.

        Raises:
            BadMessage: the bytes are not this message.

        """


_M = TypeVar("_M", bound=Message)
MESSAGES: dict[str, type[Message]] = {}
"""Topic to message type."""


@dataclass_transform(frozen_default=True)
def message(direction: DirectionName, topic: str, marks: bytes) -> Callable[[type[_M]], type[_M]]:
    """Make a class a frozen message and register it under its topic."""

    def register(cls: type[_M]) -> type[_M]:
        made = dataclass(frozen=True)(cls)
        made.topic, made.direction, made.marks = topic, direction, marks
        MESSAGES[topic] = made
        return made

    return register


def fields_of(m: Message) -> tuple[Any, ...]:
    """Its fields in order. They are values: ``dataclasses.astuple`` would copy each of them, and takes long."""
    return tuple([getattr(m, name) for name in m.__match_args__])


def unpacked(cls: type[_M], values: Sequence[Any], encode: Callable[[_M], bytes]) -> _M:
    """A message of values that have just been unpacked within their limits: they pack again, and are not tried.

    ``encode`` is the packing that they come from; a class that packs or refuses in a way of its own is made as always.
    """
    if cls.__post_init__ is not Message.__post_init__ or cls.encode is not encode:
        return cls(*values)
    made = object.__new__(cls)
    made.__dict__.update(zip(cls.__match_args__, values, strict=True))
    return made


def body_of(cls: type[Message], payload: bytes) -> bytes:
    """The payload without its type byte."""
    if payload[:1] != cls.marks:
        came = payload[:1].hex() or "nothing"
        raise BadMessage(cls.topic, f"it starts with {came}", f"Its type byte is {cls.marks.hex()}.")
    return payload[1:]


@dataclass(frozen=True)
class Counts(Message):
    """A message of small whole numbers: its type byte, then one, two or four bytes each.

    Attributes:
        limits: the greatest value of each field; the least is 0.

    """

    limits: ClassVar[tuple[int, ...]] = ()

    @classmethod
    def example(cls) -> Self:
        """The greatest numbers: the size is always the same."""
        return cls(*cls.limits)

    def encode(self) -> bytes:
        """The type byte and the fields in order."""
        return self.marks + pack_counts(fields_of(self), self.limits, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        return unpacked(cls, unpack_counts(body_of(cls, payload), cls.limits, cls.topic), Counts.encode)


def pack_number(value: int, where: str, limit: int = UINT16_MAX) -> bytes:
    """A whole number from 0 to its limit: one byte up to 255, else two. The length tells which.

    Raises:
        BadMessage: a value that is no whole number or is out of range.

    """
    return pack_counts((value,), (UINT8_MAX if value in range(UINT8_MAX + 1) else limit,), where)


def unpack_number(data: bytes, where: str, limit: int = UINT16_MAX) -> int:
    """Inverse of ``pack_number``.

    Raises:
        BadMessage: no or too many bytes, two where one does, or a value above its limit.

    """
    (value,) = unpack_counts(data, (UINT8_MAX if len(data) < 2 else limit,), where)
    if len(data) == 2 and value <= UINT8_MAX:
        raise BadMessage(where, f"{value} in two bytes", "It has one up to 255.")
    return value


@dataclass(frozen=True)
class Number(Message):
    """A message of one number: its type byte, then one byte, or two above 255."""

    @classmethod
    def example(cls) -> Self:
        """The greatest number of one byte: tables here are no longer."""
        return cls(*[UINT8_MAX])

    def encode(self) -> bytes:
        """The type byte and the number."""
        (value,) = fields_of(self)
        return self.marks + pack_number(value, self.topic)

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        return unpacked(cls, [unpack_number(body_of(cls, payload), cls.topic)], Number.encode)


@dataclass(frozen=True)
class Sized(Message):
    """A message that ends in bytes of its own: after the type byte whole numbers, the bytes' count and the bytes.

    Attributes:
        limits: the greatest value of each of the numbers before the count; the least is 0.

    """

    limits: ClassVar[tuple[int, ...]] = ()

    def encode(self) -> bytes:
        """The type byte, the numbers, the count (two bytes) and the bytes."""
        *numbers, data = fields_of(self)
        if not isinstance(data, bytes):
            raise BadMessage(self.topic, f"{type(data).__name__} cannot be sent", "Give bytes.")
        return self.marks + pack_counts((*numbers, len(data)), (*self.limits, UINT16_MAX), self.topic) + data

    @classmethod
    def decode(cls, payload: bytes) -> Self:
        """Inverse of ``encode``."""
        body = body_of(cls, payload)
        at = 2 + sum(1 if limit <= UINT8_MAX else 2 for limit in cls.limits)
        *numbers, size = unpack_counts(body[:at], (*cls.limits, UINT16_MAX), cls.topic)
        if len(body) != at + size:
            raise BadMessage(cls.topic, f"{len(body) - at} bytes where {size} were announced", "None may be missing.")
        return unpacked(cls, [*numbers, body[at:]], Sized.encode)


def index_of(name: str, names: tuple[str, ...], where: str) -> int:
    """Number of a name in a table both sites hold.

    Raises:
        BadMessage: not in the table.

    """
    if name not in names:
        raise BadMessage(where, f"unknown {name!r}", f"Known: {', '.join(names)}.")
    return names.index(name)
