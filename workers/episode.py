"""An episode: the record of one rollout, how it ended, and how bad each of its steps was."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8

DIVERGED = "diverged"
"""It is the stop reason of an episode in which something was not finite or left its bounds."""
FAILED = "failed"
"""It is the stop reason of an episode whose code raised, hung or ended its process: `workers.attempts`."""
UNUSABLE = frozenset({DIVERGED, FAILED})
"""No model learns from episodes with these stop reasons."""

Stored = UInt8[np.ndarray, " time"] | Float32[np.ndarray, " time"]
"""It holds per step one bit for each bad condition, or the degree in [0, 1] of a graded G_bad."""


@dataclass(frozen=True)
class Failure:
    """What an episode failed of.

    Attributes:
        reason: in one line; type, message, file and line where they are known.
        text: all that is known, a traceback as a rule.
    """

    reason: str
    text: str


@dataclass(frozen=True)
class Episode:
    """The record of one rollout.

    Attributes:
        x: the controller, in [0,1]^D.
        xi: the trajectory ξ, in the units of the setup's channels.
        bad: per step, one bit for each bad condition; the degree in [0, 1] of a graded G_bad.
        y: badness, the fraction of bad steps or the mean degree, in [0, 1].
        f: the objective.
        stop: why it ended early; "" when it ran to its horizon, "diverged" when the simulation exploded,
            "failed" when code raised, or the reason of the setup's stop rule. From there on ξ repeats the
            last state.
        physics: the parameters it ran under.
        failure: what a failed episode failed of, for people; it is not stored with the episode.

    A diverged or failed episode is bad throughout, and no model may learn from it. A stopped one is a fact
    about its controller, and may be learnt from: the step that gave the reason and all that were not run are
    bad as `stopped`; those before have the conditions that were seen, and f is the task's
    `stopped_objective`.
    """

    x: Float32[np.ndarray, " d"]
    xi: Float32[np.ndarray, "obs time"]
    bad: Stored
    y: float
    f: float
    stop: str
    physics: Mapping[str, float]
    failure: Failure | None = None


def degrees(
    bad: UInt8[np.ndarray, "*episodes time"] | Float32[np.ndarray, "*episodes time"],
) -> Float32[np.ndarray, "*episodes time"]:
    """How bad each step is: the degree itself, or 1 where any bit is set."""
    return bad if bad.dtype == np.float32 else (bad != 0).astype(np.float32)


def stride_steps(horizon: int, stride: int) -> slice:
    """Choose the steps that a model sees of an episode: the last one of every whole stride.

    Args:
        horizon: T, control steps.
        stride: control steps per sample, at least 1.

    Returns:
        horizon // stride places on the axis of time.
    """
    return slice(stride - 1, horizon // stride * stride, stride)
