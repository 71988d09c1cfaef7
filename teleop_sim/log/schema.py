"""Protobuf message types, derived from the record classes when this module is imported.

One message type a record class, fields numbered from 1 in the order of the class. ``float`` becomes ``double``, ``int``
``int64``, ``bool`` ``bool``, ``str`` ``string`` and ``tuple[float, ...]`` ``repeated double``. Fields have no explicit
presence (proto3): a zero is not stored and reads as zero again; NaN and minus zero are stored.

A reader takes fields by *name* from the schema in the file, so a later version may add fields anywhere.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, get_type_hints

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError, EncodeError, Message

from teleop_sim.core.records import RECORDS, Record

PACKAGE = "teleop_sim"

_Proto = descriptor_pb2.FieldDescriptorProto


@dataclass(frozen=True)
class Kind:
    """How one Python field type is stored.

    Attributes:
        number: protobuf's number of the wire type.
        repeated: many values in one field.
        missing: what a reader gives for a field that the file's schema lacks.

    """

    number: int
    repeated: bool
    missing: float | int | bool | str | tuple[float, ...]


KINDS: dict[Any, Kind] = {
    float: Kind(_Proto.TYPE_DOUBLE, False, math.nan),
    int: Kind(_Proto.TYPE_INT64, False, 0),
    bool: Kind(_Proto.TYPE_BOOL, False, False),
    str: Kind(_Proto.TYPE_STRING, False, ""),
    tuple[float, ...]: Kind(_Proto.TYPE_DOUBLE, True, ()),
}
"""Field type of a record class to how it is stored."""


def field_types(cls: type[Record]) -> dict[str, Any]:
    """Field names of a record class, in order, with their types."""
    hints = get_type_hints(cls)
    return {f.name: hints[f.name] for f in fields(cls)}


def file_proto(cls: type[Record]) -> descriptor_pb2.FileDescriptorProto:
    """One .proto file that declares one record class.

    Raises:
        TypeError: a field has a type that the log cannot store.

    """
    proto = descriptor_pb2.FileDescriptorProto(name=f"{PACKAGE}/{cls.__name__}.proto", package=PACKAGE, syntax="proto3")
    message = proto.message_type.add(name=cls.__name__)
    for number, (name, hint) in enumerate(field_types(cls).items(), start=1):
        if hint not in KINDS:
            raise TypeError(f"{cls.__name__}.{name}: the log cannot store {hint}; use float, int, bool, str or a tuple")
        label = _Proto.LABEL_REPEATED if KINDS[hint].repeated else _Proto.LABEL_OPTIONAL
        message.field.add(name=name, number=number, type=KINDS[hint].number, label=label)
    return proto


@dataclass(frozen=True)
class Schema:
    """How one topic is stored.

    Attributes:
        topic: its name, such as ``link/packet``.
        name: full name of the message type.
        data: serialised ``FileDescriptorSet``, as MCAP wants it.
        cls: record class.
        encode: record to bytes.
        decode: bytes to record; raises ``DecodeError``.

    """

    topic: str
    name: str
    data: bytes
    cls: type[Record]
    encode: Callable[[Record], bytes]
    decode: Callable[[bytes], Record]


def schema_of(topic: str, cls: type[Record]) -> Schema:
    """Derive the schema of one record class, in a descriptor pool of its own."""
    proto = file_proto(cls)
    data = descriptor_pb2.FileDescriptorSet(file=[proto]).SerializeToString(deterministic=True)
    name = f"{PACKAGE}.{cls.__name__}"
    return Schema(topic, name, data, cls, _encoder(_message_class(data, name), cls), decoder(data, name, cls))


def decoder(data: bytes, name: str, cls: type[Record]) -> Callable[[bytes], Record]:
    """Make a function from message bytes to records, for messages of any version's schema.

    Fields are matched by name and kind. Fields that only the file knows are passed over; for fields that the file lacks
    the record gets ``Kind.missing``.

    Args:
        data: serialised ``FileDescriptorSet`` from the file.
        name: full name of the message type in it.
        cls: record class to make.

    Raises:
        ValueError: ``data`` does not declare ``name``. The function raises ``DecodeError`` for bytes that do not fit.

    """
    made = _message_class(data, name)
    default: dict[str, Any] = {n: KINDS[hint].missing for n, hint in field_types(cls).items()}
    present = tuple(n for n, hint in field_types(cls).items() if _same_kind(made, n, KINDS[hint]))
    tuples = frozenset(n for n, hint in field_types(cls).items() if KINDS[hint].repeated)

    def decode(message: bytes) -> Record:
        parsed = made.FromString(message)
        found = {n: tuple(getattr(parsed, n)) if n in tuples else getattr(parsed, n) for n in present}
        return cls(**{**default, **found})

    return decode


def _encoder(made: type[Message], cls: type[Record]) -> Callable[[Record], bytes]:
    names = tuple(field_types(cls))

    def encode(record: Record) -> bytes:
        return made(**{n: getattr(record, n) for n in names}).SerializeToString(deterministic=True)

    return encode


def _message_class(data: bytes, name: str) -> type[Message]:
    pool = descriptor_pool.DescriptorPool()
    try:
        for proto in descriptor_pb2.FileDescriptorSet.FromString(data).file:
            pool.Add(proto)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    except (DecodeError, EncodeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"no usable declaration of {name}: {error}") from error


def _same_kind(made: type[Message], name: str, kind: Kind) -> bool:
    field = made.DESCRIPTOR.fields_by_name.get(name)
    return field is not None and field.type == kind.number and field.is_repeated == kind.repeated


SCHEMAS: dict[str, Schema] = {topic: schema_of(topic, cls) for topic, cls in sorted(RECORDS.items())}
"""Topic to schema, in the fixed order in which a file registers them."""
