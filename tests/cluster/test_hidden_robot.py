"""An evaluation of a run: under physics of its own."""

from functools import partial

import numpy as np

from cluster.optimization import hidden_robot
from workers import setups
from workers.rollout import rollout


def test_the_hidden_physics_belong_to_the_run_and_to_the_gap():
    setup = setups.load("franka")
    x = np.random.default_rng(0).random(setup.dimensions, dtype=np.float32)
    with setup.open() as environment:

        def f(gap: str, run: int) -> float:
            return hidden_robot(setup, partial(rollout, setup, environment), gap, run)(x).f

        gaps = ("object1_mass=1.9:2.1", "paper", "training", "wide")
        found = [f(gap, run) for gap in gaps for run in (1000, 1001)]
        assert len(set(found)) == 8
        assert f("wide", 1001) == found[-1]
