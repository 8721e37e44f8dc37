"""Every setup that ships and the example of a user's own, with a few short episodes of each."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

from workers import setups
from workers.rollout import Episode, random_episode

EXAMPLE = str(Path(__file__).parents[2] / "examples" / "two_link_pusher")
SHORT = 300  # control steps; whole episodes run in the slow tests


@pytest.fixture(scope="module", params=[*sorted(setups.SETUPS), "two_link_pusher"])
def whole(request):
    """A setup that ships, or the example of a user's own, found as a user's would be."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLE)
        patch.setenv("PYTHONPATH", f"{EXAMPLE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
        yield setups.load(request.param)


@pytest.fixture(scope="module")
def setup(whole):
    return replace(whole, horizon=min(whole.horizon, SHORT))


@pytest.fixture(scope="module")
def environment(setup):
    with setup.open() as opened:
        yield opened


@pytest.fixture(scope="module")
def episodes(setup, environment) -> list[Episode]:
    return [random_episode(setup, environment, 0, index) for index in range(6)]
