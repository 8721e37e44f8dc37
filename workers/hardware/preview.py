"""What simulations expect of a controller, for the person who lets it onto a robot."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from workers.environments.environment import Environment
from workers.episode import Episode
from workers.randomness import Stream, generator
from workers.rollout import Steps
from workers.setups import Setup

LOW, HIGH = 0.05, 0.95
"""Nine of ten simulations lie between these quantiles."""
_UNITS: Final = {"rad": "rad/s", "m": "m/s"}


@dataclass(frozen=True)
class SimulatedTrial:
    """One simulation of a controller.

    Attributes:
        episode: what came of it.
        clearance: least distance to what the robot must keep away from, in m; NaN where the task tells none.
        fastest: greatest change of a joint or coordinate among what is seen, by unit, such as rad/s.
    """

    episode: Episode
    clearance: float
    fastest: Mapping[str, float]


def simulations(setup: Setup, x: np.ndarray, seed: int, count: int) -> Iterator[SimulatedTrial]:
    """Simulate a controller under physics drawn from the ranges of data collection.

    Args:
        setup: of the robot.
        x: the controller, [D], in [0, 1].
        seed: of the physics, at least 0.
        count: how often; simulation i always has the same physics.

    Yields:
        Those whose code does not fail: a failure is told by what is missing.
    """
    with setup.open() as environment:
        for index in range(count):
            simulated = _simulate(setup, environment, x, seed, index)
            if simulated is not None:
                yield simulated


def summary(setup: Setup, simulated: list[SimulatedTrial], count: int) -> dict[str, Any]:
    """What simulations say, for people and programs.

    Args:
        setup: of the robot.
        simulated: the simulations that came to an end.
        count: how many there should have been.

    Returns:
        Plain values: `simulations`; `failed`; `y` and `f`, each with mean, low and high (the quantiles `LOW`
        and `HIGH`); `conditions`, the share of simulations in which each bad condition held at some step;
        `clearance`, the least of all, in m, or None; `fastest`, by unit.
    """
    said: dict[str, Any] = {"simulations": count, "failed": count - len(simulated)}
    if not simulated:
        return said
    episodes = [each.episode for each in simulated]
    clearances = [each.clearance for each in simulated if math.isfinite(each.clearance)]
    units = simulated[0].fastest
    return {
        **said,
        "y": _spread([episode.y for episode in episodes]),
        "f": _spread([episode.f for episode in episodes if math.isfinite(episode.f)]),
        "conditions": _shares(setup, episodes),
        "clearance": min(clearances) if clearances else None,
        "fastest": {unit: max(each.fastest[unit] for each in simulated) for unit in units},
    }


def parameters(setup: Setup, x: np.ndarray) -> list[dict[str, Any]]:
    """A controller in the units of its parameters.

    Args:
        setup: of the robot.
        x: the controller, [D], in [0, 1].

    Returns:
        Name, value and unit of each parameter.
    """
    values = setup.controller.values(np.asarray(x, np.float32)).tolist()
    return [
        {"name": parameter.name, "value": value, "unit": parameter.unit}
        for parameter, value in zip(setup.controller.parameters, values, strict=True)
    ]


def _simulate(
    setup: Setup, environment: Environment, x: np.ndarray, seed: int, index: int
) -> SimulatedTrial | None:
    physics = setup.physics.draw(generator(seed, Stream.PREVIEW, index))
    try:
        steps = Steps(setup, environment, np.asarray(x, np.float32), physics)
        while (command := steps.command()) is not None:
            steps.apply(command)
        clearance = float(setup.task.clearance(steps.observations()))
        episode = steps.episode()
    except Exception:  # noqa: BLE001 - a user's setup may raise anything; it is counted and told
        return None
    return SimulatedTrial(episode, clearance, _fastest(setup, episode))


def _fastest(setup: Setup, episode: Episode) -> dict[str, float]:
    """The greatest change per second of the channels that have a rate of a common unit."""
    found: dict[str, float] = {}
    for number, channel in enumerate(setup.observation):
        if channel.unit in _UNITS and episode.xi.shape[1] > 1:
            rate = float(np.abs(np.diff(episode.xi[number])).max()) / setup.control_step
            unit = _UNITS[channel.unit]
            found[unit] = max(found.get(unit, 0.0), rate)
    return found


def _shares(setup: Setup, episodes: list[Episode]) -> dict[str, float]:
    if setup.task.graded:
        return {setup.conditions[0]: float(np.mean([episode.bad.max() > 0 for episode in episodes]))}
    bits = [int(np.bitwise_or.reduce(episode.bad)) for episode in episodes]
    return {
        name: float(np.mean([bool(each >> number & 1) for each in bits]))
        for number, name in enumerate(setup.conditions)
    }


def _spread(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    low, high = np.quantile(values, (LOW, HIGH)).tolist()
    return {"mean": float(np.mean(values)), "low": low, "high": high}
