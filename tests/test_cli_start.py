"""The command line's quick start, seen from a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys

CODE = """
import os, sys
from teleop_sim.cli_start import start_quickly
start_quickly()
import mujoco
print(os.environ["MUJOCO_GL"], "glfw" in sys.modules)
"""


def started(**settings: str) -> str:
    left = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    call = [sys.executable, "-c", CODE]
    return subprocess.run(call, capture_output=True, text=True, check=True, env=left | settings).stdout.strip()


def test_no_window_library_is_loaded() -> None:
    assert started() == "disable False"


def test_a_user_s_own_renderer_is_left_alone() -> None:
    assert started(MUJOCO_GL="glfw") == "glfw True"
