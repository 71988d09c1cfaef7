"""Open a file as a log, or say why it is none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from teleop_sim.core.errors import LogDamaged
from teleop_sim.core.records import RECORDS
from teleop_sim.log.scan import Scan, read_file, scan
from teleop_sim.log.store import Kind

A_LOG = "a log is a .mcap file that teleop-sim run has written"


def read_bytes(path: Path) -> memoryview:
    """A file's bytes.

    Raises:
        LogDamaged: there is no such file, or it cannot be read.

    """
    try:
        if path.exists() and not path.is_file() and not path.is_dir():
            raise LogDamaged(str(path), "a device, not a log")  # /dev/zero has no end
        return read_file(path)
    except OSError as error:
        raise LogDamaged(str(path), _why(path, error)) from error


def open_scan(path: Path, wanted: Callable[[str], bool] = RECORDS.__contains__) -> Scan:
    """What is whole in a log.

    Raises:
        LogDamaged: there is no such file, it is no log, or not one record in it is whole; a schema cannot be used.

    """
    try:
        found = scan(read_bytes(path), wanted)
    except ValueError as error:
        if isinstance(error, LogDamaged):
            raise
        raise LogDamaged(str(path), f"{error}; {A_LOG}") from error
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


def kinds_of(found: Scan) -> tuple[Kind, ...]:
    """The topics of a scan as the file declares them."""
    return tuple(Kind(topic, *found.schemas.get(schema, ("", b""))) for topic, schema in found.kinds)


def _why(path: Path, error: OSError) -> str:
    if path.is_dir():
        return "a directory, not a log"
    part = path.with_name(path.name + ".part")
    if not path.exists() and part.exists():
        return f"no such file; what an unfinished run has written so far is in {part.name}"
    return "no such file" if isinstance(error, FileNotFoundError) else f"cannot be read: {error.strerror}"
