"""Commands that follow from what is seen: linear feedback of any robot."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float32

from workers.controllers.controller import Command, Controller
from workers.environments.environment import Channel, Environment


class LinearFeedback(Controller):
    """u = clip(K o + b): every command is a weighted sum of channels of ξ as they are now, and a constant.

    D = command channels · (channels fed back + 1). o is in the units of ξ, so that a gain is a number that
    one can picture, such as 30 N/rad.

    Args:
        observation: the channels of ξ.
        action: the command channels; their bounds are those of the clip.
        gains: least and greatest gain of every channel that is fed back, by its name, in units of the command
            per unit of the channel.
        bias: least and greatest b, in units of the command.
    """

    def __init__(
        self,
        observation: Sequence[Channel],
        action: Sequence[Channel],
        *,
        gains: Mapping[str, tuple[float, float]],
        bias: tuple[float, float],
    ) -> None:
        rows = {channel.name: row for row, channel in enumerate(observation)}
        unknown = [name for name in gains if name not in rows]
        if unknown:
            raise ValueError(
                f"gains must name channels of ξ, got {unknown[0]!r}; the channels are {', '.join(rows)}"
            )
        self._rows = [rows[name] for name in gains]
        self._low = np.array([channel.low for channel in action])
        self._high = np.array([channel.high for channel in action])
        self.parameters = tuple(
            parameter for command in action for parameter in _parameters(command, observation, gains, bias)
        )

    def start(self, x: Float32[np.ndarray, " d"], environment: Environment, horizon: int) -> Command:  # noqa: ARG002
        """Look at the environment in every step, and answer.

        Args:
            x: the controller, [D], in [0, 1].
            environment: the simulation that is controlled, open and reset.
            horizon: not looked at.

        Returns:
            The command of each step, in the units of the command channels.
        """
        weights = self.values(x).reshape(len(self._low), -1)
        gains, bias = weights[:, :-1], weights[:, -1]
        rows, low, high = self._rows, self._low, self._high

        def command(_: int) -> Sequence[float]:
            seen = environment.observed([environment.record()]).xi[rows, 0].astype(np.float64)
            return np.minimum(
                np.maximum(gains @ seen + bias, low), high
            ).tolist()  # np.clip takes twice as long

        return command


def _parameters(
    command: Channel,
    observation: Sequence[Channel],
    gains: Mapping[str, tuple[float, float]],
    bias: tuple[float, float],
) -> list[Channel]:
    """One gain for every channel that is fed back to this command, and its bias."""
    units = {channel.name: channel.unit for channel in observation}
    return [
        *(
            Channel(f"{command.name}_per_{name}", f"{command.unit}/({units[name]})", low, high)
            for name, (low, high) in gains.items()
        ),
        Channel(f"{command.name}_bias", command.unit, *bias),
    ]
