"""The chaos tests kill the same processes as the hardware tests, and tear machines from the same cluster."""

import pytest

from tests.chaos.drivers import Drivers
from tests.cluster.conftest import machines
from tests.cluster.hardware.conftest import processes

__all__ = ["drivers", "machines", "processes"]


@pytest.fixture
def drivers():
    """Drivers to start, none of which outlives the test."""
    started = Drivers()
    yield started
    started.end()
