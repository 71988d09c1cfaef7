"""One direction of the link: bytes in, bytes out later or never, a record of each packet's fate. See docs/link.md."""

from __future__ import annotations

import numpy as np
import simpy

from teleop_sim.channel.counters import Counters
from teleop_sim.channel.message import DirectionName
from teleop_sim.channel.radio import Radio
from teleop_sim.channel.radio_base import Carrier, LinkClosed, Receive
from teleop_sim.channel.radio_planned import PlannedRadio
from teleop_sim.channel.settings import DirectionSettings
from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.records import Emit

__all__ = ["Direction", "DirectionSettings", "LinkClosed", "Receive"]


class Direction:
    """One direction of the link on the clock. Sites hold only its ``send`` and are told by ``receive``.

    Neutral settings get ``PlannedRadio``, which is fast; all others ``Radio``. They agree.

    Args:
        env: the clock.
        name: ``up`` or ``down``.
        settings: what it can do.
        receive: told of each payload that arrives.
        emit: told of each record.
        rng: needed for loss and jitter only.

    Raises:
        BadInput: loss or jitter without ``rng``.

    """

    def __init__(
        self,
        env: simpy.Environment,
        name: DirectionName,
        settings: DirectionSettings,
        receive: Receive,
        emit: Emit,
        rng: np.random.Generator | None = None,
    ) -> None:
        self.name = name
        self.settings = settings
        self._carrier: Carrier = (
            PlannedRadio(env, name, settings, receive, emit)
            if settings.neutral
            else Radio(env, name, settings, receive, emit, rng)
        )

    @property
    def counters(self) -> Counters:
        """What became of the packets so far, by topic."""
        return self._carrier.counters

    @property
    def sent(self) -> int:
        """Packets offered so far: ``delivered + dropped + in_flight``, and after ``close`` those it ended."""
        return self._carrier.sent

    @property
    def sent_bits(self) -> int:
        """With headers, of all packets offered."""
        return self._carrier.sent_bits

    @property
    def delivered(self) -> int:
        """Packets whose last bit has arrived."""
        return self.counters.total.delivered

    @property
    def delivered_bits(self) -> int:
        """With headers, of all packets delivered."""
        return self.counters.total.delivered_bits

    @property
    def dropped(self) -> int:
        """Packets dropped for a named reason."""
        return sum(self.counters.total.dropped.values())

    @property
    def in_flight(self) -> int:
        """Packets queued, in service or propagating."""
        return self._carrier.in_flight

    def utilisation(self) -> float:
        """Share of the time so far in which bits went out, 0 to 1."""
        return self._carrier.utilisation()

    def send(self, topic: str, payload: bytes, text: str = "", priority: int = 0, keep: bool = False) -> None:
        """Offer a packet now.

        Args:
            topic: label in logs and counters; not transmitted.
            payload: all bytes that cross, before headers.
            text: what it means, for the log; never transmitted.
            priority: greater is more urgent; counts under the discipline ``priority`` only.
            keep: neither superseded nor superseding under the discipline ``newest``.

        Raises:
            LinkClosed: after ``close``.

        """
        self._carrier.send(topic, payload, text, priority, keep)

    def switch_rate(self, rate_bps: float) -> None:
        """From now on this rate, whatever the schedule said, also for the fragment under way.

        Raises:
            BadInput: a rate that is not above zero, or a direction made without ``rates``.

        """
        if not rate_bps > 0.0:
            what = f"a rate of {rate_bps} bit/s delivers nothing"
            raise BadInput((Problem("rate_bps", what, "Give above zero."),))
        if not (self.settings.rates and isinstance(self._carrier, Radio)):
            hint = f"Make it with rates=((0.0, {self.settings.rate_bps}),)."
            raise BadInput((Problem("rates", "this direction has one rate for good", hint),))
        self._carrier.switch_rate(rate_bps)

    def close(self) -> None:
        """End the run: every packet on its way ends ``in_flight``, in order of packet number. Again: no effect."""
        self._carrier.close()
