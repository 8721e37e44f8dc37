"""The Franka for short episodes, under a user's own G_bad."""

from dataclasses import replace

import pytest


@pytest.fixture(scope="session")
def franka():
    from workers import setups

    return replace(setups.load("franka"), horizon=60)


@pytest.fixture(scope="module")
def environment(franka):
    with franka.open() as opened:
        yield opened


@pytest.fixture
def episode(franka, environment, gentle):  # noqa: ARG001 - the module must be there
    """name of a function, index -> that episode of seed 0 under that G_bad."""
    from workers.rollout import random_episode
    from workers.setups.user_bad import with_bad

    return lambda name, index=1: random_episode(with_bad(franka, f"gentle:{name}"), environment, 0, index)
