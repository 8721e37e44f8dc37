"""The chaos tests kill the same processes as the hardware tests, and tear machines from the same cluster."""

import pytest

from tests.chaos.drivers import Drivers, collected_here, published
from tests.cluster.conftest import machines
from tests.cluster.hardware.conftest import processes

__all__ = ["drivers", "machines", "processes", "undisturbed"]


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory):
    """The files of a collection without faults."""
    return published(collected_here(tmp_path_factory.mktemp("undisturbed") / "dataset").folder)


@pytest.fixture
def drivers():
    """Drivers to start, none of which outlives the test."""
    started = Drivers()
    yield started
    started.end()
