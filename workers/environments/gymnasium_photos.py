"""Pictures of an environment of Gymnasium, drawn by itself: `render_mode="rgb_array"`."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import UInt8

from workers.environments.gymnasium_world import World, name_of
from workers.simulation.artist import Artist, State
from workers.simulation.sketch import fit
from workers.user_code import UserCodeError


class GymnasiumPhotos(Artist):
    """Puts an environment of its own into each step of ξ, and lets it draw; nothing is simulated.

    So ξ must hold all that is seen. What the environment needs to draw, OpenGL or pygame, must be there.

    Args:
        make: makes the environment; it is called with `render_mode="rgb_array"`, as
            `functools.partial(gymnasium.make, "Hopper-v5")` may be.
        pose: puts the environment into a step of ξ, given by the names of its channels.
    """

    def __init__(self, make: Callable[..., World], pose: Callable[[World, State], None]) -> None:
        self._make = make
        self._pose = pose
        self._world: World | None = None

    def picture(self, state: State, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Let the environment draw one step, and fit its picture into the size.

        Args:
            state: the step of ξ, by the names of its channels.
            width: in pixels.
            height: in pixels.

        Returns:
            Red, green and blue, from the top left, [height, width, 3].

        Raises:
            UserCodeError: the environment draws no such picture.
        """
        if self._world is None:
            self._world = self._make(render_mode="rgb_array")
            self._world.reset(seed=0)
        self._pose(self._world, state)
        drawn: Any = np.asarray(self._world.render())
        if drawn.ndim != 3 or drawn.shape[2] != 3 or drawn.dtype != np.uint8:
            raise UserCodeError(
                f"render() of {name_of(self._world)} must return uint8 [height, width, 3], got {drawn.dtype} "
                f"of shape {drawn.shape}; draw it with workers.simulation.sketch.Sketch instead"
            )
        return fit(drawn, width, height)

    def close(self) -> None:
        """Close the environment that drew; the next picture opens another."""
        if self._world is not None:
            self._world.close()
            self._world = None
