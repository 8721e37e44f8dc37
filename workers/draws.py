"""What each episode of a dataset is of: a controller and its physics, decided by seed and index alone."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float32

from workers.physics import Physics, PhysicsRanges
from workers.randomness import Stream, generator
from workers.setups import Setup

EPISODE: Final = "episode"
"""Each episode has physics of its own."""
REPEAT: Final = "repeat"
"""The first episodes of all controllers share their physics, and so do the second ones, and all further."""
PHYSICS_OF: Final = (EPISODE, REPEAT)


@dataclass(frozen=True, eq=False)
class Draws:
    """How a dataset's episodes are drawn.

    Attributes:
        seed: of all controllers and physics.
        repeats: how many consecutive episodes share a controller.
        physics_of: one of `PHYSICS_OF`, what has physics of its own.
        chosen: controllers that come first, before those that are drawn; None for none.
    """

    seed: int
    repeats: int = 1
    physics_of: str = EPISODE
    chosen: Float32[np.ndarray, "c d"] | None = None

    def controller(self, dimensions: int, index: int) -> Float32[np.ndarray, " d"]:
        """The controller of an episode.

        Args:
            dimensions: D, of a controller that is drawn.
            index: of the episode.

        Returns:
            A point of the unit cube, [D].
        """
        number = index // self.repeats
        if self.chosen is not None and number < len(self.chosen):
            return self.chosen[number].copy()
        return generator(self.seed, Stream.CONTROLLER, number).random(dimensions, dtype=np.float32)

    def physics(self, ranges: PhysicsRanges, index: int) -> Physics:
        """The physics of an episode.

        Args:
            ranges: of every parameter.
            index: of the episode.

        Returns:
            A value for every parameter, by name.
        """
        number = index if self.physics_of == EPISODE else index % self.repeats
        return ranges.draw(generator(self.seed, Stream.PHYSICS, number))

    def episode(self, setup: Setup, index: int) -> tuple[Float32[np.ndarray, " d"], Physics]:
        """What is rolled out as an episode; it depends on nothing else.

        Args:
            setup: robot, controller and task.
            index: of the episode.

        Returns:
            The controller, [D], in [0, 1], and the physics.
        """
        return self.controller(setup.dimensions, index), self.physics(setup.physics, index)
