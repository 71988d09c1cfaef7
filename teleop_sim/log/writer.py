"""Write one run's records and views to one MCAP file, aside first and renamed when finished.

The file is a pure function of what is written and shown: fixed names in the header, channels in a fixed order (those of
``LATE_TOPICS`` and of views behind, when they are first used), one thread and no wall clock.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np

from teleop_sim.core.errors import BadInput, Problem
from teleop_sim.core.records import LATE_TOPICS, RECORDS, PlantSample, Record, RunStarted
from teleop_sim.core.views import SceneTree, View
from teleop_sim.log.foxglove import MOTION, encoded, view_topic
from teleop_sim.log.foxglove_motion import Motion, motion_of
from teleop_sim.log.mcap_file import MESSAGE_HEADER_BYTES, McapFile
from teleop_sim.log.scan import scan
from teleop_sim.log.schema import SCHEMAS
from teleop_sim.log.wire import doubles

PROFILE = "teleop-sim"
CHUNK_BYTES = 64 * 1024
COMPRESSION = 1
"""Level of zstd: 1 takes a fifth less time than its default, for 2 % more bytes (measured)."""
FLUSH_S = 30.0  # assumed: a killed run loses at most so much simulated time, for some 2 % more bytes

_PLANT = "field/plant"
_MOVING = "field/plant and what moves"
"""Topic of a sample that waits for its chunk, and for ``MOTION`` to be made of it; it has two sequence numbers."""
_PELVIS_BYTES, _JOINTS_FIELD = 7 * 8, 3
"""Of a stored ``PlantSample``."""

_TOPICS = {cls: topic for topic, cls in RECORDS.items()}


class LogWriter:
    """Writes records to ``<path>.part``; ``close`` finishes the file and renames it to ``path``.

    It is callable, so it can be handed to the simulator as its ``Emit``, and ``show`` as its ``Show``; a log to which
    nothing is shown holds records only. A process that is killed leaves a ``.part`` that reads up to its last chunk: at
    most 64 KiB or 30 simulated seconds are lost. As a context manager it closes at a normal end, calls ``interrupt`` at
    a KeyboardInterrupt, and after any other exception leaves a finished ``.part``.

    ``durable``: wait until the disk has the file, so that it outlives a power failure. It costs some 50 ms a file, in
    which other processes' files wait too; a killed process loses nothing either way.

    Raises:
        BadInput: another run is writing the same log at this moment.
        OSError: the file cannot be created or written.

    """

    def __init__(self, path: Path | str, durable: bool = True) -> None:
        self.path = Path(path)
        self._durable = durable
        self.part = self.path.with_name(self.path.name + ".part")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        # Messages wait here for their chunk: an interruption between two appends leaves nothing half done.
        self._waiting: list[tuple[str, int, int, bytes]] = []
        self._waiting_bytes = 0
        self._count = 0
        self._flushed_s = 0.0
        self._motion: Motion | None = None
        self._done = False
        self._open(self.part)

    def __call__(self, record: Record) -> None:
        """Write one record; see ``write``."""
        self.write(record)

    def write(self, record: Record) -> None:
        """Append one record; of a ``PlantSample`` also what moves, once a ``SceneTree`` has been shown.

        Raises:
            TypeError: the record's class is not registered, or a field holds what its type does not allow.
            ValueError: the file is finished already.

        """
        topic = _TOPICS.get(type(record))
        if topic is None:
            raise TypeError(f"{type(record).__name__} is no registered record; declare it with @record(topic)")
        data = SCHEMAS[topic].encode(record)
        if self._motion is not None and isinstance(record, PlantSample) and self._motion.fits(record):
            topic = _MOVING
            self._count += 1
        self._append(topic, record.t_s, data)
        late = record.t_s - self._flushed_s >= FLUSH_S
        if self._waiting_bytes >= CHUNK_BYTES or late or isinstance(record, RunStarted):
            self._flushed_s = record.t_s
            self._finish_chunk()

    def show(self, view: View) -> None:
        """Append what people may look at.

        Raises:
            ValueError: the file is finished already.

        """
        if isinstance(view, SceneTree):
            self._motion = motion_of(view)
        for topic, data in encoded(view):
            self._append(topic, view.t_s, data)

    def _append(self, topic: str, t_s: float, data: bytes) -> None:
        if self._stream.closed:
            raise ValueError(f"{self.path}: the log is finished; nothing can be added")
        self._count += 1
        self._waiting.append((topic, self._count, round(t_s * 1e9), data))
        # What moves is not counted: it is seven times as long as its sample, and nearly the same each time.
        self._waiting_bytes += len(data) + MESSAGE_HEADER_BYTES

    def close(self) -> None:
        """Finish the file and rename it to its final name. Does nothing the second time."""
        if self._done:
            return
        if not self._stream.closed:
            self._finish()
        self._at.replace(self.path)
        self.part.unlink(missing_ok=True)
        self._done = True

    def interrupt(self) -> None:
        """Finish after an interruption: the file gets its final name and, having no ``RunEnded``, says what it is.

        May be called wherever the interruption struck, also in the middle of ``write``.
        """
        if not self._stream.closed and self._cut_here:
            self._write_again()
        self.close()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        elif issubclass(kind, KeyboardInterrupt):
            self.interrupt()
        elif not self._done:
            self._finish()
            self._done = True

    def _open(self, path: Path) -> None:
        self._at = path
        self._stream: IO[bytes] = _open_alone(path)
        self._cut_here = False
        # Chunks end where this class says, so that it always knows what is in the file.
        self._mcap = McapFile(self._stream, PROFILE, COMPRESSION)
        self._channels = {topic: _register(self._mcap, topic) for topic in SCHEMAS if topic not in LATE_TOPICS}
        self._mcap.flush()

    def _finish_chunk(self) -> None:
        if not self._waiting:
            return
        messages = self._encoded()
        self._cut_here = True
        with self._named():
            for topic, sequence, time_ns, data in messages:
                if topic not in self._channels:
                    self._channels[topic] = _register(self._mcap, topic)
                self._mcap.add(self._channels[topic], time_ns, data, sequence)
            self._mcap.flush()
        self._waiting.clear()
        self._waiting_bytes = 0
        self._cut_here = False

    def _encoded(self) -> Iterator[tuple[str, int, int, bytes | memoryview]]:
        """What waits; of samples also what moves, all at once: that takes a fifth of the time of one by one."""
        samples = [(time_ns, data) for topic, _, time_ns, data in self._waiting if topic == _MOVING]
        moved: Iterator[memoryview] = iter(())
        if self._motion is not None and samples:
            numbers = _numbers([data for _, data in samples], self._motion.joints)
            moved = iter(self._motion.encode([time_ns for time_ns, _ in samples], numbers))
        for topic, sequence, time_ns, data in self._waiting:
            if topic == _MOVING:
                yield _PLANT, sequence - 1, time_ns, data
                yield MOTION, sequence, time_ns, next(moved)
            else:
                yield topic, sequence, time_ns, data

    def _finish(self) -> None:
        self._finish_chunk()
        self._cut_here = True
        with self._named():
            self._mcap.finish()
            self._stream.flush()
            if self._durable:
                os.fsync(self._stream.fileno())
            self._stream.close()

    @contextmanager
    def _named(self) -> Iterator[None]:
        """A full disk names no file by itself."""
        try:
            yield
        except OSError as error:
            error.filename = error.filename or str(self._at)
            raise

    def _write_again(self) -> None:
        """Start the file again from its whole chunks and what still waits: the chunk under way was cut."""
        self._stream.close()
        kept = [(m.topic, m.sequence, m.time_ns, m.data) for m in scan(self.part.read_bytes()).messages]
        last = kept[-1][1] if kept else 0
        self._waiting = kept + [message for message in self._waiting if message[1] > last]
        self._open(self.path.with_name(self.path.name + ".again"))


def _open_alone(path: Path) -> IO[bytes]:
    """Open a file for writing from its start, if no other run has it open: two writers would leave neither's log."""
    while True:
        stream = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb")
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.close()
            hint = "Wait for its end, or give another directory or seed."
            raise BadInput((Problem(str(path), "another run is writing it", hint),)) from None
        except OSError:  # a file system without locks
            pass
        # The run that had it may have finished and renamed it since.
        if path.exists() and path.stat().st_ino == os.fstat(stream.fileno()).st_ino:
            stream.truncate()
            return stream
        stream.close()


def _register(mcap: McapFile, topic: str) -> int:
    schema = SCHEMAS.get(topic)
    if schema is not None:
        return mcap.register(topic, schema.name, schema.data)
    view = view_topic(topic)
    return mcap.register(topic, view.schema, view.data, view.schema_encoding, view.message_encoding)


def _numbers(samples: list[bytes], joints: int) -> np.ndarray:
    """Pelvis and joints (n, 7 + joints) of encoded samples: each ends with both, eight bytes a number."""
    head = len(doubles(_JOINTS_FIELD, (0.0,) * joints)) - 8 * joints
    size = _PELVIS_BYTES + head + 8 * joints
    table = np.frombuffer(b"".join([data[-size:] for data in samples]), np.uint8).reshape(-1, size)
    whole = np.concatenate([table[:, :_PELVIS_BYTES], table[:, _PELVIS_BYTES + head :]], axis=1)
    return whole.view("<f8")
