"""A patch as bytes for the link: its form in one byte, then JSON, deflated (RFC 1951). Reading runs nothing of it.

The JSON is in its shortest form with the operations as tables, states and edges in them as ``plain`` has them. The same
patch gives the same bytes with the same version of zlib. A dictionary that both sites hold saves the words of the form.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from types import MappingProxyType

from teleop_sim.core.errors import TeleopError
from teleop_sim.machines.elements import Given
from teleop_sim.machines.operations import (
    AddOutcome,
    AddState,
    Operation,
    Patch,
    RemoveOutcome,
    RemoveState,
    SetData,
    SetDefault,
    SetParameter,
    SetTarget,
    SetThreshold,
)
from teleop_sim.machines.plain import (
    THRESHOLDS,
    edge_plain,
    element_plain,
    read_edge,
    read_edges,
    read_element,
    read_threshold,
    value_plain,
)
from teleop_sim.machines.plain_table import Plain, Table

MOST_BYTES = 1 << 20
"""Of the JSON: a small message must not fill the memory of who reads it."""

_FORM = b"\x01"
_DEFLATE = -15
"""zlib's number for deflate without a header, with its largest window."""

_WORDS = (
    b'"failed","inherit","command","operator","retry","parameters":{"name":"value":,"rows":[{"signal":"","counters":'
    b'[{"limit":0,"event":""}],"failed":""}],"reads":{"writes":{"manual":true,"decides":true,"outcomes":["finish":'
    b'"start":"states":[{"program":"remove_state","path":"add_outcome","in":"","edge":{"set_parameter","set_data",'
    b'{"op":"add_state","in":"","state":{"name":"","program":""},"edges":[{"state":"","event":"","to":"","threshold":'
    b'"off"},"kind":"raised_by":"set_default","remove_outcome","path":"set_target","path":"","event":"","to":""}'
    b'{"base":4,"do":[{"op":"set_threshold","path":"","event":"","threshold":"high"},"low"},"full"}]}'
)
"""Deflate's dictionary: what patches are made of, the commonest last."""


class BadPatch(TeleopError, ValueError):
    """Bytes that are no patch."""

    def __init__(self, what: str) -> None:
        super().__init__(what)

    def __str__(self) -> str:
        return f"patch: {self.args[0]}\n  Both sites must hold the same version of the simulator."


def pack_patch(patch: Patch) -> bytes:
    """The bytes of a patch.

    Raises:
        BadPatch: it could not be read again: too large, a threshold or a text that there is not.

    """
    try:
        text = _text(patch)
    except KeyError as error:
        raise BadPatch(f"there is no threshold {error}") from None
    except UnicodeEncodeError as error:
        raise BadPatch(str(error)) from None
    if len(text) > MOST_BYTES:
        raise BadPatch(f"{len(text)} bytes before they are packed, more than {MOST_BYTES}")
    deflate = zlib.compressobj(9, zlib.DEFLATED, _DEFLATE, zdict=_WORDS)
    return _FORM + deflate.compress(text) + deflate.flush()


def unpack_patch(data: bytes) -> Patch:
    """Inverse of ``pack_patch``; no other bytes are taken.

    Raises:
        BadPatch: the bytes are none.

    """
    if data[:1] != _FORM:
        raise BadPatch(f"begins with {data[:1].hex() or 'nothing'}, not with {_FORM.hex()}")
    try:
        inflate = zlib.decompressobj(_DEFLATE, _WORDS)
        text = inflate.decompress(data[1:], MOST_BYTES + 1)
        if not inflate.eof or inflate.unused_data or len(text) > MOST_BYTES:
            raise BadPatch(f"{len(data)} bytes do not come out even, or hold more than {MOST_BYTES}")
        patch = _read(Table(json.loads(text)))
        same = _text(patch) == text
    except RecursionError:
        raise BadPatch("is nested too deeply") from None
    except (zlib.error, ValueError) as error:
        if isinstance(error, BadPatch):
            raise
        raise BadPatch(f"{len(data)} bytes: {error}") from None
    if not same:
        raise BadPatch("is not in its shortest form")
    return patch


def _text(patch: Patch) -> bytes:
    plain = {"base": patch.base_checksum, "do": [_plain(operation) for operation in patch.operations]}
    return json.dumps(plain, ensure_ascii=False, separators=(",", ":")).encode()


def _read(table: Table) -> Patch:
    base, operations = table.number("base"), tuple(_operation(inner) for inner in table.tables("do"))
    table.close()
    if table.problems:
        raise BadPatch(str(table.problems[0]))
    return Patch(base, operations)


def _plain(operation: Operation) -> Plain:
    match operation:
        case AddState(container, state, edges, end):
            rest: Plain = {"state": element_plain(state), "edges": [edge_plain(edge) for edge in edges]}
            return {"op": "add_state", "in": container} | rest | ({"end": True} if end else {})
        case RemoveState(path):
            return {"op": "remove_state", "path": path}
        case AddOutcome(container, edge):
            return {"op": "add_outcome", "in": container, "edge": edge_plain(edge)}
        case RemoveOutcome(path, event):
            return {"op": "remove_outcome", "path": path, "event": event}
        case SetTarget(path, event, next_state):
            return {"op": "set_target", "path": path, "event": event, "to": next_state}
        case SetThreshold(path, event, threshold):
            return {"op": "set_threshold", "path": path, "event": event, "threshold": THRESHOLDS[threshold]}
        case SetParameter(path, name, value):
            return {"op": "set_parameter", "path": path, "name": name, "value": value_plain(value)}
        case SetData(path, key, value):
            return {"op": "set_data", "path": path, "name": key, "value": value_plain(value)}
        case SetDefault(parameter, value):
            return {"op": "set_default", "name": parameter, "value": value_plain(value)}


def _operation(table: Table) -> Operation:
    made = _READERS[table.choice("op", tuple(_READERS), None)](table)
    table.close()
    return made


def _add_state(table: Table) -> AddState:
    return AddState(table.text("in", None), read_element(table.table("state")), read_edges(table), table.flag("end"))


def _set_default(table: Table) -> SetDefault:
    value = table.value("value")
    return SetDefault(table.text("name", None), "" if isinstance(value, Given) else value)


_READERS: MappingProxyType[str, Callable[[Table], Operation]] = MappingProxyType(
    {
        "add_state": _add_state,
        "remove_state": lambda t: RemoveState(t.text("path", None)),
        "add_outcome": lambda t: AddOutcome(t.text("in", None), read_edge(t.table("edge"))),
        "remove_outcome": lambda t: RemoveOutcome(t.text("path", None), t.text("event", None)),
        "set_target": lambda t: SetTarget(t.text("path", None), t.text("event", None), t.text("to")),
        "set_threshold": lambda t: SetThreshold(t.text("path", None), t.text("event", None), read_threshold(t)),
        "set_parameter": lambda t: SetParameter(t.text("path", None), t.text("name", None), t.value("value")),
        "set_data": lambda t: SetData(t.text("path", None), t.text("name", None), t.value("value")),
        "set_default": _set_default,
    }
)
