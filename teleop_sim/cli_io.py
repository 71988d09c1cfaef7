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
    """Print a text and its line end on standard error."""
    try:
        typer.echo(text, err=True)
    except BrokenPipeError:
        forget_reader(sys.stderr)


def prepare() -> None:
    """Print what the terminal's encoding lacks as a question mark."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def flush() -> None:
    """Send on what still waits for standard output, so that the interpreter's end finds nothing to complain about."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        forget_reader(sys.stdout)


def forget_reader(stream: TextIO) -> None:
    """Let all further output of a stream go nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
