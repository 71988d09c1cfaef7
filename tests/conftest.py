"""What tests of whole runs share."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def laws() -> ModuleType:
    """``tests/laws.py``, which no import finds: tests are no package."""
    spec = importlib.util.spec_from_file_location("laws_of_a_log", Path(__file__).with_name("laws.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # A dataclass looks up its module by name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
