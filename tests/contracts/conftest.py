"""Every setup that ships and the examples of users' own, with a few short episodes of each."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from workers import setups
from workers.episode import Episode
from workers.rollout import random_episode

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = ("two_link_pusher", "cart_pole", "gymnasium_hopper")
SHORT = 300  # control steps; whole episodes run in the slow tests
# They share the code of others: make test-slow runs them too.
ALIKE = ("daisy-11d", "daisy-11d-mujoco", "gymnasium_hopper")


def each_setup(fast: Callable[[str], bool]) -> list[Any]:
    """Every setup that ships and every example, those that are not fast marked as slow."""
    names = (*sorted(setups.SETUPS), *EXAMPLES)
    return [name if fast(name) else pytest.param(name, marks=pytest.mark.slow) for name in names]


@pytest.fixture(
    scope="module",
    params=each_setup(lambda name: name not in ALIKE and not name.endswith("-rehearsal")),
)
def whole(request):
    """A setup that ships, or an example of a user's own, found as a user's would be."""
    if request.param == "gymnasium_hopper":
        pytest.importorskip("mujoco")
    with pytest.MonkeyPatch.context() as patch:
        if request.param in EXAMPLES:
            folder = str(FOLDER / request.param)
            patch.syspath_prepend(folder)
            patch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
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
