"""A drawing as a file: DOT as it is, pictures by Graphviz's program ``dot`` (a system package, not a Python one)."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from teleop_sim.core.errors import BadInput, Problem

TEXT = (".dot", ".gv")
PICTURES = (".svg", ".png", ".pdf")
_MISSING = "pictures are made by Graphviz's program dot, which is not here"
_INSTALL = "Install it (apt install graphviz, brew install graphviz), or write a .dot file."


def refuse_suffix(path: Path) -> None:
    """Raise ``BadInput`` unless a drawing can be written so: by its suffix, and to Graphviz being there."""
    suffix = path.suffix.lower()
    if suffix not in (*TEXT, *PICTURES):
        known = ", ".join((*TEXT, *PICTURES))
        raise BadInput((Problem(str(path), f"{suffix or 'no suffix'} is no kind of drawing", f"Give one of {known}."),))
    if suffix in PICTURES and not can_draw():
        raise BadInput((Problem(str(path), _MISSING, _INSTALL),))


def can_draw() -> bool:
    """Whether Graphviz's program is here."""
    return shutil.which("dot") is not None


def drawn(dot: str, suffix: str, path: str = "drawing") -> bytes:
    """DOT text as a picture: ``svg``, ``png`` or ``pdf``. The same version of Graphviz makes the same SVG of it.

    Raises:
        BadInput: Graphviz is not installed or cannot lay the drawing out; ``path`` is its place.

    """
    program = shutil.which("dot")
    if program is None:
        raise BadInput((Problem(path, _MISSING, _INSTALL),))
    # The text comes on standard input and the suffix is one of ours: nothing of it is a command.
    done = subprocess.run([program, f"-T{suffix}"], input=dot.encode(), capture_output=True, check=False)  # noqa: S603
    if done.returncode or not done.stdout:
        why = done.stderr.decode(errors="replace").strip() or f"it ended with code {done.returncode}"
        raise BadInput((Problem(path, f"dot made no picture: {why}", "Write a .dot file to see what it was given."),))
    return done.stdout


def write_drawing(dot: str, path: Path) -> None:
    """Write DOT text as .dot, .gv, .svg, .png or .pdf; see ``drawn``.

    Raises:
        BadInput: another suffix, Graphviz is not installed or cannot lay the drawing out.
        OSError: the file cannot be written.

    """
    refuse_suffix(path)
    suffix = path.suffix.lower()
    if suffix in TEXT:
        path.write_text(dot, encoding="utf-8")
    else:
        path.write_bytes(drawn(dot, suffix[1:], str(path)))
