"""A drawing as a file: DOT as it is, pictures by Graphviz's program ``dot`` (a system package, not a Python one)."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from teleop_sim.core.errors import BadInput, Problem

TEXT = (".dot", ".gv")
PICTURES = (".svg", ".png", ".pdf")


def refuse_suffix(path: Path) -> None:
    """Raise ``BadInput`` unless a drawing can be written so: by its suffix, and to Graphviz being there."""
    suffix = path.suffix.lower()
    if suffix not in (*TEXT, *PICTURES):
        known = ", ".join((*TEXT, *PICTURES))
        raise BadInput((Problem(str(path), f"{suffix or 'no suffix'} is no kind of drawing", f"Give one of {known}."),))
    if suffix in PICTURES and shutil.which("dot") is None:
        hint = "Install it (apt install graphviz, brew install graphviz), or write a .dot file."
        raise BadInput((Problem(str(path), "pictures are made by Graphviz's program dot, which is not here", hint),))


def write_drawing(dot: str, path: Path) -> None:
    """Write DOT text as .dot, .gv, .svg, .png or .pdf. The same version of Graphviz makes the same SVG of it.

    Raises:
        BadInput: another suffix, Graphviz is not installed or cannot lay the drawing out.
        OSError: the file cannot be written.

    """
    refuse_suffix(path)
    if path.suffix.lower() in TEXT:
        path.write_text(dot, encoding="utf-8")
        return
    program = shutil.which("dot")
    assert program is not None
    # The text comes on standard input and the suffix is one of ours: nothing of it is a command.
    command = [program, f"-T{path.suffix.lower()[1:]}"]
    done = subprocess.run(command, input=dot.encode(), capture_output=True, check=False)  # noqa: S603
    if done.returncode or not done.stdout:
        why = done.stderr.decode(errors="replace").strip() or f"it ended with code {done.returncode}"
        raise BadInput(
            (Problem(str(path), f"dot made no picture: {why}", "Write a .dot file to see what it was given."),)
        )
    path.write_bytes(done.stdout)
