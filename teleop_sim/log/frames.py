"""The tidy frames that one log and many logs have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

from teleop_sim.core.errors import UnknownName

if TYPE_CHECKING:
    import pandas as pd

FRAMES = {
    "packets": "link/packet",
    "messages": "link/message",
    "transitions": "machine/transition",
    "modes": "machine/mode",
    "requests": "machine/request",
    "released": "machine/released",
    "acts": "operator/act",
    "layers": "operator/layer",
    "judgements": "operator/judgement",
    "episodes": "field/episode",
    "waits": "field/wait",
    "disturbances": "field/disturbance",
    "claims": "field/claim",
    "scores": "task/score",
}
"""Name of a frame to the topic of which it has one row a record."""


class Frames(ABC):
    """DataFrames of one row an event. Each is made when it is first asked for.

    Columns are the fields of the record (docs/log.md), with ``t`` (timedelta) beside ``t_s`` and ``took`` (timedelta)
    beside ``start_s``. Text of few kinds is categorical.
    """

    @abstractmethod
    def frame(self, topic: str) -> pd.DataFrame:
        """Any topic as a frame.

        Raises:
            UnknownName: there is no such topic.
            LogDamaged: a record does not fit its schema.

        """

    def columns(self, name: str) -> pd.DataFrame:
        """What the columns of a frame are, such as of ``packets``: column, dtype, unit, meaning.

        Raises:
            UnknownName: there is no frame of that name.

        """
        from teleop_sim.log.meanings import EVERY_FRAME, describe

        if name not in EVERY_FRAME:
            raise UnknownName("frame", name, EVERY_FRAME)
        return describe(name, getattr(self, name))

    @property
    @abstractmethod
    def runs(self) -> pd.DataFrame:
        """One row a run: what was run and how it ended."""

    @property
    @abstractmethod
    def blackouts(self) -> pd.DataFrame:
        """One row a blackout: direction, start_s, end_s (NaN: still dark when the log ends), t, took."""

    @property
    @abstractmethod
    def plant(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``: t_s, pelvis position [m] and quaternion, every joint [rad or m]."""

    @property
    @abstractmethod
    def joints(self) -> pd.DataFrame:
        """One row a sample, indexed by ``t``: a column a joint [rad or m]."""

    @cached_property
    def packets(self) -> pd.DataFrame:
        """One row a packet whose fate is known; columns of ``PacketEnded``."""
        return self.frame("link/packet")

    @cached_property
    def messages(self) -> pd.DataFrame:
        """One row a message whose delivery repeats or acknowledges; columns of ``MessageEnded``."""
        return self.frame("link/message")

    @cached_property
    def transitions(self) -> pd.DataFrame:
        """One row a transition of the machine, self-loops too; columns of ``TransitionTaken``."""
        return self.frame("machine/transition")

    @cached_property
    def modes(self) -> pd.DataFrame:
        """One row a change of the machine's mode; columns of ``ModeChanged``."""
        return self.frame("machine/mode")

    @cached_property
    def requests(self) -> pd.DataFrame:
        """One row a request to the operator; columns of ``Requested``."""
        return self.frame("machine/request")

    @cached_property
    def released(self) -> pd.DataFrame:
        """One row a command that arrived at the field site; columns of ``Released``."""
        return self.frame("machine/released")

    @cached_property
    def acts(self) -> pd.DataFrame:
        """One row a thing the operator did; columns of ``OperatorActed``."""
        return self.frame("operator/act")

    @cached_property
    def layers(self) -> pd.DataFrame:
        """One row a work of the crew at a layer of control below a behaviour; columns of ``Layer``."""
        return self.frame("operator/layer")

    @cached_property
    def judgements(self) -> pd.DataFrame:
        """One row a claim that the crew compared with what had arrived; columns of ``Judged``."""
        return self.frame("operator/judgement")

    @cached_property
    def episodes(self) -> pd.DataFrame:
        """One row a skill from start to rest; columns of ``EpisodeEnded``."""
        return self.frame("field/episode")

    @cached_property
    def waits(self) -> pd.DataFrame:
        """One row a wait at the field site; columns of ``Waited``."""
        return self.frame("field/wait")

    @cached_property
    def disturbances(self) -> pd.DataFrame:
        """One row a figure of what went otherwise than the robot believed; columns of ``Disturbed``."""
        return self.frame("field/disturbance")

    @cached_property
    def claims(self) -> pd.DataFrame:
        """One row a thing that the robot showed the operator; columns of ``Claimed``, positions by coordinate."""
        return self.frame("field/claim")

    @cached_property
    def scores(self) -> pd.DataFrame:
        """One row a finding of the task's scorer; columns of ``Scored``."""
        return self.frame("task/score")
