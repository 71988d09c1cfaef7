"""Standard output and standard error; a reader that went away (``| head``) is no error and changes no exit code."""

from __future__ import annotations

import io
import os
import sys
from typing import TextIO

import typer


def say(text: str) -> None:
    """Print a text and its line end on standard output."""
    try:
        typer.echo(text)
    except BrokenPipeError:
        forget_reader(sys.stdout)


def warn(text: str) -> None:
    """Print a text and its line end on standard error, if it can be written to: there is nowhere else to complain."""
    try:
        typer.echo(text, err=True)
    except OSError:
        forget_reader(sys.stderr)


def prepare() -> None:
    """Give every closed standard stream somewhere to go, and print what the terminal's encoding lacks as ``?``."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            # Left free, the number would go to the next file that is opened, and stray output into the log.
            _nowhere(number)
            setattr(sys, name, open(number, "r" if number == 0 else "w", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def flush() -> None:
    """Send on what still waits for standard output, so that the interpreter's end finds nothing to complain about."""
    try:
        sys.stdout.flush()
    except OSError:
        forget_reader(sys.stdout)


def forget_reader(stream: TextIO) -> None:
    """Let all further output of a stream go nowhere."""
    _nowhere(stream.fileno())


def _nowhere(number: int) -> None:
    nowhere = os.open(os.devnull, os.O_RDWR)
    if nowhere != number:
        os.dup2(nowhere, number)
        os.close(nowhere)
