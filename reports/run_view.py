"""A run as its report sees it: records without the plant's, the plant on demand, the scenario's tables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from teleop_sim.core.records import PlantSample, Record
from teleop_sim.log.load import Log
from teleop_sim.reports.captions import chosen
from teleop_sim.reports.shares import duration_s


@dataclass(frozen=True, eq=False)
class Run:
    """One run's log, read once. ``log``: may be cut off or interrupted."""

    log: Log

    @cached_property
    def records(self) -> tuple[Record, ...]:
        """All but the plant's samples, in order.

        Raises:
            LogDamaged: a record does not fit its schema.

        """
        return tuple(r for r in self.log.records() if not isinstance(r, PlantSample))

    @cached_property
    def end_s(self) -> float:
        """When the run ended, or its log does [s]."""
        return duration_s(self.records)

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The scenario's tables; empty where the log does not say."""
        return chosen(self.records)
