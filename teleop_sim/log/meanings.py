"""What the columns of frames mean, in a few words each. The classes in ``core/records.py`` say it at length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from teleop_sim.log.frames import FRAMES

if TYPE_CHECKING:
    import pandas as pd

UNITS = {
    "_s": "s",
    "_bps": "bit/s",
    "_bits": "bit",
    "_bytes": "byte",
    "_m": "m",
    "_rad": "rad",
    "_px": "px",
    "_sd": "standard deviations",
}
"""Suffix of a field's name to its unit."""

MEANINGS = {
    "t_s": "when the record was written, simulated",
    "t": "the same as a timedelta: the log's own time, exact",
    "took": "from start to end; NaT where one is not known",
    "log": "which log: the file's name from the directory",
    "cell": "of the sweep",
    "start_s": "when it began",
    "end_s": "when it was over; NaN: still going on when the log ends",
    "state": "of the machine, by its path",
    "event": "outcome of the state, or what the operator may confirm",
    "next_state": "to which the machine went",
    "entered_s": "when the state was entered",
    "how": "autonomous, confirmed or forced",
    "mode": "normal, auto, manual or not_recoverable",
    "retries": "failures so far in this row of attempts",
    "threshold": "of the outcome: it passes by itself at a level above",
    "level": "of autonomy: 0 off, 1 low, 2 high, 3 full",
    "waited_s": "suggested before it passed",
    "note": "in words",
    "text": "in words, for readers of the log; not sent",
    "direction": "up (to the robot) or down",
    "topic": "kind of message",
    "number": "of the message in its direction, from 0",
    "packet": "number of the packet in its direction",
    "payload_bytes": "of the message, without headers",
    "size_bits": "on the link, with headers",
    "sent_s": "handed to the link",
    "service_s": "its first bit went out; NaN: never",
    "arrived_s": "its last bit arrived; NaN: never",
    "delivered_s": "the other site's application got it; NaN: never",
    "queue_s": "waited behind others",
    "blackout_s": "waited in the dark",
    "serialisation_s": "its bits going out",
    "propagation_s": "under way",
    "retransmission_s": "sent in vain",
    "copies": "offered to the link, in all its parts",
    "reason": "why it was dropped",
    "priority": "greater is more urgent",
    "outcome": "how it ended",
    "cause": "why, in words",
    "request": "number of the request; 0: none",
    "kind": "of it",
    "command": "what was commanded",
    "effect": "what came of the command",
    "skill": "of the robot",
    "physics_s": "of it computed with MuJoCo",
    "why": "it waited",
    "what": "which thing",
    "values": "one number, or the components of a vector",
    "picture": "checksum of the picture that went with it",
    "error_m": "between claimed and true",
    "role": "of the person",
    "layer": "of control: alignment, template or teleoperation",
    "offset_px": "between picture and claim",
    "sigma_px": "what an eye can tell",
    "d_prime_sd": "their ratio",
    "evidence_sd": "with the eye's noise",
    "criterion_sd": "above it the claim is rejected",
    "verdict": "accepted, rejected or unseen",
    "checkpoint": "of the task, from 1",
    "scenario": "its name",
    "seed": "of all chance",
    "replicate": "draw of all chance",
    "time_limit_s": "of the run",
    "versions": "of the program and its libraries",
    "completion_time_s": "NaN unless completed",
    "round_trips": "requests that were answered",
    "operator_acts": "of all people",
    "interrupted": "the run did not end by itself",
    "runs.outcome": "completed, failed or censored (the time limit came first)",
    "packets.outcome": "delivered, dropped or in_flight (the run ended first)",
    "messages.outcome": "delivered, dropped or in_flight (the run ended first)",
    "runs.t": "end_s as a timedelta",
    "runs.end_s": "time of the last record",
    "blackouts.t": "when it began, as a timedelta",
    "disturbances.text": "the value of what is no number",
    "disturbances.what": "which figure; its unit is the name's ending",
    "episodes.command": "with its parameters",
    "requests.kind": "confirm, decide, data, manual or act",
    "waits.kind": "pacing (a fixed wait of the program) or operator",
    "acts.kind": "read, decide, send, talk ...",
    "acts.text": "the command sent, or what was looked at",
    "messages.queue_s": "light time behind others, or kept back by its sender",
    "messages.serialisation_s": "bits of the copy that arrived",
    "messages.propagation_s": "that copy under way, and held by the receiver",
    "messages.retransmission_s": "copies in vain",
    "scores.text": "the finding in words",
    **{f"claimed_{axis}_m": "where the robot believed it, odometry frame" for axis in "xyz"},
    **{f"true_{axis}_m": "where it was" for axis in "xyz"},
    **{f"pelvis_{axis}": "position of the pelvis, world frame" for axis in "xyz"},
    **{f"pelvis_q{axis}": "orientation of the pelvis, quaternion" for axis in "wxyz"},
}
"""Column, or ``frame.column`` where a frame has its own sense of it, to what it means."""

EVERY_FRAME = ("runs", *FRAMES, "blackouts", "plant", "joints")
"""Names of all frames."""


def unit(column: str) -> str:
    """Of a column's values; empty: none."""
    if column.startswith("pelvis_") and "q" not in column:
        return "m"
    return next((name for suffix, name in UNITS.items() if column.endswith(suffix)), "")


def describe(name: str, frame: pd.DataFrame) -> pd.DataFrame:
    """The columns of a frame, one a row: column, dtype, unit, meaning.

    Joints are radians, or metres where they slide; factors of a sweep have the scenario's meaning.
    """
    import pandas as pd

    index = [(str(frame.index.name), str(frame.index.dtype))] if frame.index.name else []
    rows = [(column, kind, *_told(name, column)) for column, kind in (*index, *_kinds(frame))]
    return pd.DataFrame(rows, columns=["column", "dtype", "unit", "meaning"], dtype="str")


def _kinds(frame: pd.DataFrame) -> Sequence[tuple[str, str]]:
    return [(str(column), str(kind)) for column, kind in frame.dtypes.items()]


def _told(name: str, column: str) -> tuple[str, str]:
    meaning = MEANINGS.get(f"{name}.{column}") or MEANINGS.get(column)
    if meaning is not None:
        return unit(column), meaning
    return ("rad or m", "joint of the model") if name in ("plant", "joints") else (unit(column), "factor of the sweep")
