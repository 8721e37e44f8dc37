"""What the contracts of setups have in common: physics in the middle, and commands step by step."""

import numpy as np


def nominal(setup) -> dict[str, float]:
    return {name: (low + high) / 2 for name, (low, high) in setup.physics.intervals.items()}


def commands_of(setup, environment, x, physics) -> list[np.ndarray]:
    environment.reset(physics)
    command = setup.controller.start(x, environment, setup.horizon)
    issued = []
    for step in range(setup.horizon):
        issued.append(np.array(command(step)))
        environment.step(issued[-1].tolist())
    return issued
