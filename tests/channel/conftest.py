"""What tests of deliveries share."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def talk() -> ModuleType:
    """``tests/channel/talk.py``, which no import finds: tests are no package."""
    spec = importlib.util.spec_from_file_location("talk_over_a_link", Path(__file__).with_name("talk.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # A dataclass looks up its module by name.
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
