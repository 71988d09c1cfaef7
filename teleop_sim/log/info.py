"""What a log is, at a glance: run, end, topics, size."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.opcode import Opcode

from teleop_sim.core.records import RECORDS
from teleop_sim.log.derived import ENDED, STARTED
from teleop_sim.log.found import Scan
from teleop_sim.log.load import open_log
from teleop_sim.log.opening import read_bytes
from teleop_sim.log.pieces import Piece, pieces
from teleop_sim.log.scan import scan


@dataclass(frozen=True)
class TopicInfo:
    """One topic: messages, their bytes before compression, and the times of the first and last [s]."""

    topic: str
    messages: int
    bytes: int
    first_s: float
    last_s: float


@dataclass(frozen=True)
class LogInfo:
    """A log at a glance.

    Attributes:
        path: of the file. size_bytes: of it. chunks: in it.
        whole: the file's end was reached. interrupted: the run did not end by itself.
        end_s: time of the last record [s].
        run: what was run and how it ended; None: not known.
        topics: by name, teleop-sim's own first.

    """

    path: str
    size_bytes: int
    chunks: int
    whole: bool
    interrupted: bool
    end_s: float
    run: dict[str, Any]
    topics: tuple[TopicInfo, ...]


def log_info(path: Path) -> LogInfo:
    """What a log is.

    Raises:
        LogDamaged: it cannot be read.

    """
    log, data = open_log(path), read_bytes(path)
    started, ended = (next(log.records(topic), None) for topic in ("run/started", "run/ended"))
    run = {name: getattr(started, name, None) for name in STARTED} | {
        name: getattr(ended, name, None) for name in ENDED
    }
    chunks = sum(1 for piece in pieces(data) if isinstance(piece, Piece) and piece.opcode == Opcode.CHUNK)
    return LogInfo(str(path), len(data), chunks, log.whole, log.interrupted, log.end_s, run, _topics(scan(data)))


def _topics(found: Scan) -> tuple[TopicInfo, ...]:
    notes = np.concatenate([np.empty((5, 0), dtype=np.int64), *(block.notes for block in found.blocks)], axis=1)
    made = []
    for topic in sorted({topic for topic, _ in found.kinds}, key=lambda topic: (topic not in RECORDS, topic)):
        numbers = [number for number, (name, _) in enumerate(found.kinds) if name == topic]
        own = notes[:, np.isin(notes[0], numbers)]
        if own.shape[1]:
            times_ns = own[1].view(np.uint64)
            span = (int(times_ns.min()) / 1e9, int(times_ns.max()) / 1e9)
            made.append(TopicInfo(topic, own.shape[1], int(own[4].sum()), *span))
    return tuple(made)
