"""The controller that is its own command."""

import numpy as np

from workers.controllers.constant import Constant
from workers.environments.environment import Channel


def test_every_step_commands_the_physical_values_of_x():
    controller = Constant((Channel("speed", "m/s", -2.0, 2.0), Channel("angle", "rad", 0.0, 0.5)))
    assert controller.dimensions == 2
    command = controller.start(np.array([0.25, 1.0], np.float32), environment=None, horizon=3)
    assert [list(command(step)) for step in (0, 1, 2)] == [[-1.0, 0.5]] * 3
