"""Standard output and standard error; a reader that went away (``| head``) is no error and changes no exit code."""

from __future__ import annotations

import os
import sys

import typer


def say(text: str) -> None:
    """Print a text and its line end on standard output."""
    try:
        typer.echo(text)
    except BrokenPipeError:
        forget_reader()


def warn(text: str) -> None:
    """Print a text and its line end on standard error."""
    typer.echo(text, err=True)


def flush() -> None:
    """Send on what still waits for standard output, so that the interpreter's end finds nothing to complain about."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        forget_reader()


def forget_reader() -> None:
    """Let all further output go nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
