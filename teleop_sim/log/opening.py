"""Open a file as a log, or say why it is none."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import RECORDS
from teleop_sim.log.found import Scan
from teleop_sim.log.scan import scan
from teleop_sim.log.store import Kind

_A_LOG = "a log is a .mcap file that teleop-sim run has written"
_GZIP = b"\x1f\x8b"


def read_bytes(path: Path) -> memoryview:
    """A file's bytes.

    Raises:
        LogDamaged: there is no such file, or it cannot be read.

    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise LogDamaged(str(path), "a device, not a log")  # /dev/zero has no end
        return _whole_file(path)
    except OSError as error:
        raise LogDamaged(str(path), _why(path, error)) from error


def open_scan(path: Path, wanted: Callable[[str], bool] = RECORDS.__contains__) -> Scan:
    """What is whole in a log.

    Raises:
        LogDamaged: there is no such file, it is no log, or not one record in it is whole; a schema cannot be used.

    """
    data = read_bytes(path)
    try:
        found = scan(data, wanted)
    except ValueError:
        raise no_log(path, data) from None
    if not found.blocks and not found.whole:
        raise LogDamaged(str(path), "cut off before its first record")
    if not found.blocks:
        raise LogDamaged(str(path), "an MCAP file, but none of its topics are teleop-sim's")
    for kind in kinds_of(found):
        try:
            _ = kind.decode
        except ValueError as error:
            raise LogDamaged(str(path), f"the schema of {kind.topic} cannot be used: {error}") from error
    return found


def no_log(path: Path, data: memoryview) -> LogDamaged:
    """What to raise of a file that does not begin as MCAP does."""
    why = "not an MCAP file" if len(data) else "empty"
    if data[: len(_GZIP)] == _GZIP:
        why = "packed with gzip: unpack it first"
    return LogDamaged(str(path), f"{why}; {_A_LOG}")


def kinds_of(found: Scan) -> tuple[Kind, ...]:
    """The topics of a scan as the file declares them."""
    return tuple(Kind(topic, *found.schemas.get(schema, ("", b""))) for topic, schema in found.kinds)


def _whole_file(path: Path) -> memoryview:
    """A file's bytes. They lie in an array, because numpy asks for large pages, which are there sooner."""
    with path.open("rb", buffering=0) as stream:
        place = np.empty(os.fstat(stream.fileno()).st_size, dtype=np.uint8).data
        at = 0
        while at < len(place) and (more := stream.readinto(place[at:])):
            at += more
        return place[:at]


def _why(path: Path, error: OSError) -> str:
    if path.is_dir():
        return "a directory, not a log"
    part = path.with_name(path.name + ".part")
    if not path.exists() and part.exists():
        return f"no such file; what an unfinished run has written so far is in {part.name}"
    return "no such file" if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}"
