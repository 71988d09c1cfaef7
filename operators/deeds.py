"""A piece of work with a template, and what comes of it: ``template_layer.py`` plans it, a person carries it out."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Literal

from teleop_sim.channel.messages import Message
from teleop_sim.core.records import Record

LayerName = Literal["", "alignment", "template", "teleoperation"]
Awaited = Literal["", "cloud", "step", "hand"]


@dataclass(frozen=True)
class Made:
    """What is sent and what is written down when a piece of work is over."""

    messages: tuple[Message, ...] = ()
    records: tuple[Record, ...] = ()


@dataclass(frozen=True)
class Deed:
    """A piece of work.

    Attributes:
        layer: of control that it belongs to; empty: none.
        text: what is done, for readers of the log.
        work_s: mean time [s].
        make: at its end, with the time [s]: what comes of it.
        awaits: what has to arrive before the next.
        patience_s: how long it may take beyond round trip and patience [s].
        meanwhile: what is done while that is awaited.

    """

    layer: LayerName
    text: str
    work_s: float
    make: Callable[[float], Made]
    awaits: Awaited = ""
    patience_s: float = 0.0
    meanwhile: tuple[Deed, ...] = ()


Deeds = Generator[Deed, bool, bool]
"""Deeds one after the other. Sent: whether what a deed awaits has come. Returned: whether the work succeeded."""


def only(*messages: Message) -> Callable[[float], Made]:
    """Work that ends in sending these."""
    return lambda _now_s: Made(messages)
