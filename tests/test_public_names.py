"""The public names of the package: each is what it says, whatever was imported before."""

import subprocess
import sys

import pytest

import teleop_sim


@pytest.mark.parametrize("name", teleop_sim.__all__)
def test_a_public_name_is_the_same_before_and_after_its_module_is_loaded(name):
    code = (
        "import teleop_sim, importlib\n"
        f"first = getattr(teleop_sim, {name!r})\n"
        "importlib.import_module('teleop_sim.run'); importlib.import_module('teleop_sim.log.load')\n"
        f"assert getattr(teleop_sim, {name!r}) is first or first == teleop_sim.__version__, first\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, teleop_sim; print([m for m in ('numpy', 'mujoco', 'pandas', 'simpy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
