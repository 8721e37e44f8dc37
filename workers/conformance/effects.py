"""Checks that need episodes of their own: what is commanded, what changes a trajectory, and Gymnasium."""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils.env_checker import check_env

from workers.collection.independence import difference
from workers.conformance.remark import Remark, Severity
from workers.conformance.sample import Sample
from workers.environments.environment import Channel, Environment
from workers.episode import FAILED, UNUSABLE, Episode
from workers.gymnasium_environment import SetupEnvironment
from workers.randomness import Stream, generator
from workers.rollout import draw, rollout

SECONDS = 10.0
"""Each of these checks takes about so long."""
ENOUGH = 20
"""A physics parameter that shows in none of so many controllers is not used; some show in few only."""
CONTROLLERS = 2
"""A parameter of the controller is tried on so many of them."""


def check_commands(sample: Sample) -> Iterator[Remark]:
    """Environment and setup agree, and commands are what the environment's action channels say."""
    with sample.setup.open() as environment:
        for name, own in (
            ("observation", tuple(environment.observation)),
            ("control_step", environment.control_step),
        ):
            stated = getattr(sample.setup, name)
            if own != stated:
                text = (
                    f"{name} of the environment is {own}, that of the setup {stated}; state one of them twice"
                )
                yield Remark("commands", Severity.MISTAKE, text)
        commands: list[Any] = []
        step = environment.step

        def listen(command: Sequence[float]) -> Any:
            commands.append(list(command))
            return step(command)

        environment.step = listen  # type: ignore[method-assign]
        environment.run_commands = partial(Environment.run_commands, environment)  # type: ignore[method-assign]
        for index in list(sample.usable)[:CONTROLLERS]:
            rollout(sample.setup, environment, *draw(sample.setup, sample.seed, index))
        yield from _check_commands(commands, environment.action)


def _check_commands(commands: list[Any], channels: Sequence[Channel]) -> Iterator[Remark]:
    odd = next((command for command in commands if len(command) != len(channels)), None)
    if odd is not None:
        names = ", ".join(channel.name for channel in channels)
        text = f"the controller commands {len(odd)} numbers, the environment's action has {len(channels)}"
        yield Remark("commands", Severity.MISTAKE, f"{text} ({names}); make them agree")
        return
    for channel, values in zip(channels, np.array(commands, dtype=float).T, strict=True):
        outside = values[~((values >= channel.low) & (values <= channel.high))]
        if outside.size:
            yield Remark(
                "commands",
                Severity.DOUBT,
                f"the controller commands {outside[0]:.4g} {channel.unit} to {channel.name}, whose bounds "
                f"are [{channel.low:g}, {channel.high:g}]; clip it, or widen the bounds",
            )


def check_physics(sample: Sample) -> Iterator[Remark]:
    """Every physics parameter changes something."""
    middle = sample.setup.physics.middle()
    affordable = max(1, sample.affordable(SECONDS) // 2)
    xs = [episode.x for episode in sample.usable.values()][:affordable]
    for name, (low, high) in sample.setup.physics.intervals.items():
        pairs = ([(x, {**middle, name: value}) for value in (low, high)] for x in xs)
        if low < high and all(_are_alike(sample.attempts.rollouts(pair)) for pair in pairs):
            yield Remark(
                "physics",
                Severity.MISTAKE if len(xs) >= ENOUGH else Severity.DOUBT,
                f"{name} changes nothing in {len(xs)} controllers: its two ends {low:g} and {high:g} give "
                f"the same trajectories; use physics[{name!r}] in reset(), or leave it out",
            )


def check_parameters(sample: Sample) -> Iterator[Remark]:
    """Every parameter of the controller changes something."""
    names = [parameter.name for parameter in sample.setup.controller.parameters]
    bases = [sample.episodes[index].x for index in list(sample.usable)[:CONTROLLERS]]
    affordable = max(1, sample.affordable(SECONDS) // (2 * max(len(bases), 1)))
    order = generator(sample.seed, Stream.CONTROLLER, 0).permutation(len(names))[:affordable]
    physics = sample.setup.physics.middle()
    for place in sorted(order.tolist()):
        pairs = ([(_with(x, place, value), physics) for value in (0.1, 0.9)] for x in bases)
        if bases and all(_are_alike(sample.attempts.rollouts(pair)) for pair in pairs):
            text = f"parameter {names[place]} of the controller changes nothing in {len(bases)} controllers"
            yield Remark("parameters", Severity.DOUBT, f"{text}; use it in start(), or leave it out")
    if len(order) < len(names):
        text = f"{len(order)} of {len(names)} parameters were tried, for want of time"
        yield Remark("parameters", Severity.FACT, text)


def _with(x: np.ndarray, place: int, value: float) -> np.ndarray:
    changed = x.copy()
    changed[place] = value
    return changed


def _are_alike(pair: Sequence[Episode]) -> bool:
    """Whether two episodes are the same; of those that diverged or failed, nobody can tell."""
    one, other = pair
    return not {one.stop, other.stop} & UNUSABLE and not difference(one, other)


def check_gymnasium(sample: Sample) -> Iterator[Remark]:
    """Gymnasium's own checker has nothing against it; what it raises breaks the check off, and is told.

    It takes random actions in this process, and so is kept from code that failed: that may hang, or end it.
    """
    if any(episode.stop == FAILED for episode in sample.episodes):
        text = "not asked: its random actions might hang or end this process, as they did episodes"
        yield Remark("gymnasium", Severity.FACT, text)
    elif sample.usable:
        with warnings.catch_warnings(), closing(SetupEnvironment(sample.setup)) as environment:
            warnings.simplefilter("ignore")  # of bounds beyond [-1, 1] and of no registry, which are meant
            environment.action_space.seed(sample.seed)
            check_env(environment, skip_render_check=True)
