"""A whole episode in compiled code has every byte of the control loop, one step after the other."""

import numpy as np
import pytest

from workers.environments.environment import Environment
from workers.rollout import draw, rollout


def _differing(setup, monkeypatch, episodes: range) -> list[int]:
    """Indices of the episodes that differ when the environment is kept from running them by itself."""
    cases = [draw(setup, 3, index) for index in episodes]
    with setup.open() as environment:
        native = [rollout(setup, environment, *case) for case in cases]
        with monkeypatch.context() as patch:
            patch.setattr(type(environment), "run_commands", Environment.run_commands)
            stepped = [rollout(setup, environment, *case) for case in reversed(cases)][::-1]
    return [
        index
        for index, one, other in zip(episodes, native, stepped, strict=True)
        if (one.xi.tobytes(), one.bad.tobytes(), one.f) != (other.xi.tobytes(), other.bad.tobytes(), other.f)
    ]


def test_native_episodes_are_those_of_the_control_loop(setup, monkeypatch):
    assert _differing(setup, monkeypatch, range(4)) == []


@pytest.mark.slow
def test_hundreds_of_native_episodes_are_those_of_the_control_loop(setup, monkeypatch):
    assert _differing(setup, monkeypatch, range(300)) == []


def test_a_command_without_a_plan_is_followed_step_by_step(setup):
    """A controller of the user's own offers none, or wraps one that does."""
    x, physics = draw(setup, 3, 1)
    with setup.open() as environment:
        environment.reset(physics)
        planned = setup.controller.start(x, environment, 50)
        expected = np.asarray(environment.run_commands(planned, 50))
        environment.reset(physics)
        command = setup.controller.start(x, environment, 50)
        found = np.asarray(environment.run_commands(lambda step: command(step), 50))
    assert expected.tobytes() == found.tobytes()


def test_a_part_of_a_plan_is_run_like_the_whole(setup):
    x, physics = draw(setup, 3, 1)
    with setup.open() as environment:
        runs = []
        for horizon, steps in ((50, 50), (50, 20)):
            environment.reset(physics)
            command = setup.controller.start(x, environment, horizon)
            runs.append(environment.run_commands(command, steps))
    whole, part = runs
    assert part.tobytes() == whole[:20].tobytes()
