"""Physics and controllers of every setup: what counts, and what is refused."""

from functools import partial

import numpy as np
import pytest

from tests.contracts.steps import nominal
from workers.physics import PhysicsRanges
from workers.randomness import Stream, generator
from workers.rollout import rollout

REVEALING = {"yumi": (0, 19), "yumi-rehearsal": (0, 429), "two_link_pusher": (4,)}
"""Controllers that hit what they should: only a blow to both rolls of the YuMi shows restitution."""


def test_every_physics_parameter_changes_the_trajectory(setup, whole, environment):
    middle = nominal(setup)
    run = partial(rollout, whole if whole.name in REVEALING else setup, environment)
    controllers = [
        generator(0, Stream.CONTROLLER, index).random(setup.dimensions, dtype=np.float32)
        for index in REVEALING.get(setup.name, (0,))
    ]
    unchanged = [run(x, middle).xi for x in controllers]
    for name, value in middle.items():
        varied = middle | {name: value * 1.05}
        differs = (
            not np.array_equal(run(x, varied).xi, xi) for x, xi in zip(controllers, unchanged, strict=True)
        )
        assert any(differs), f"{name} changes nothing"


def test_physics_with_an_unknown_or_missing_parameter_is_refused(setup, environment):
    x = np.full(setup.dimensions, 0.5)
    with pytest.raises(ValueError, match="gravity"):
        rollout(setup, environment, x, nominal(setup) | {"gravity": 9.81})
    for name in nominal(setup):
        with pytest.raises(ValueError, match=name):
            rollout(setup, environment, x, {k: v for k, v in nominal(setup).items() if k != name})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda x: np.append(x, 0.5), r"shape \(\d+,\)"),
        (lambda x: x[:-1], r"shape \(\d+,\)"),
        (lambda x: x.reshape(1, -1), r"shape \(\d+,\)"),
        (lambda x: np.where(np.arange(x.size) == 3, np.nan, x), r"x\[3\] is nan"),
        (lambda x: np.where(np.arange(x.size) == 2, 1.01, x), r"x\[2\] is 1.01"),
        (lambda x: np.where(np.arange(x.size) == 0, -0.01, x), r"x\[0\] is -0.01"),
        (lambda x: np.where(np.arange(x.size) == 1, np.inf, x), r"x\[1\] is inf"),
    ],
)
def test_controllers_outside_the_unit_cube_are_refused(setup, environment, spoil, message):
    with pytest.raises(ValueError, match=message):
        rollout(setup, environment, spoil(np.full(setup.dimensions, 0.5)), nominal(setup))


@pytest.mark.parametrize("interval", [(0.2, 0.1), (0.0, float("inf")), (float("nan"), 1.0)])
def test_impossible_physics_ranges_are_refused(interval):
    with pytest.raises(ValueError, match="physics range of mass"):
        PhysicsRanges({"mass": interval})
