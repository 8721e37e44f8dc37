"""A robot of a user's own, with whatever mistake a test plants in it."""

import importlib
import sys

import pytest

from tests.own_robot import write_robot
from workers import setups


@pytest.fixture
def own_robot(tmp_path, monkeypatch):
    """Loads the robot of `tests.own_robot` as a module of its own, with some texts of its source replaced."""
    monkeypatch.syspath_prepend(tmp_path)
    written = []

    def load(*changes: tuple[str, str], name: str = "own_glider"):
        write_robot(tmp_path, name, *changes)
        written.append(name)
        importlib.invalidate_caches()
        return setups.load(name)

    yield load
    for name in written:
        sys.modules.pop(name, None)
