"""Short episodes of the Franka to be drawn."""

from dataclasses import replace

import pytest


@pytest.fixture(scope="session")
def setup():
    from workers import setups

    return replace(setups.load("franka"), horizon=60)
