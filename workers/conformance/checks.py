"""Checks of what a robot shows in its episodes."""

import math
from collections.abc import Iterator

import numpy as np

from workers.collection.independence import REMEDY, difference, told_dependence
from workers.conformance.remark import Remark, Severity
from workers.conformance.sample import Sample
from workers.dataset.notes import value_notes
from workers.episode import DIVERGED, FAILED

_JUMP = math.pi
"""An angle that changes by so much within a step, in rad, has come round to the other end of its range."""

_ROOMY = 0.25
"""A channel that uses less than this part of its bounds is named,"""
_NAMED = 4
"""and so many of them at most."""


def check_episodes(sample: Sample) -> Iterator[Remark]:
    """Episodes come to their end."""
    stops = [episode.stop for episode in sample.episodes]
    for failed in sample.report.failures[:1]:
        share = f"{stops.count(FAILED)} of {len(stops)} episodes failed"
        yield Remark(
            "episodes", Severity.MISTAKE, f"{share}, episode {failed.index} with {failed.failure.reason}"
        )
    if stops.count(DIVERGED) == len(stops):
        yield Remark(
            "episodes", Severity.MISTAKE, f"all {len(stops)} episodes diverged: {_divergence(sample)}"
        )
    elif stops.count(DIVERGED):
        text = f"{stops.count(DIVERGED)} of {len(stops)} episodes diverged: {_divergence(sample)}"
        yield Remark("episodes", Severity.DOUBT, text)


def _divergence(sample: Sample) -> str:
    index = [episode.stop for episode in sample.episodes].index(DIVERGED)
    return (
        f"a channel of episode {index} left its bounds, or something in it is not finite; widen the bounds, "
        f"or look at it with `svaedc render --setup {sample.setup.name} --x random:SEED`"
    )


def check_determinism(sample: Sample) -> Iterator[Remark]:
    """The same episode has the same bytes in another process."""
    told = difference(sample.episodes[0], sample.ends[0]) if 0 in sample.ends else ""
    if told:
        text = f"episode 0 is another one in another process: {told}. {REMEDY}"
        yield Remark("determinism", Severity.MISTAKE, text)


def check_state(sample: Sample) -> Iterator[Remark]:
    """An episode does not depend on those before it; of one that is never the same, nobody can tell."""
    told = told_dependence(dict(enumerate(sample.episodes)), sample.ends)
    if told and not list(check_determinism(sample)):
        yield Remark("state", Severity.MISTAKE, told)


def check_worth(sample: Sample) -> Iterator[Remark]:
    """Objective, badness and channels vary, and fit their limits."""
    if not sample.usable:
        return
    columns = [sample.dataset.read(shard) for shard in sample.dataset.shards()]
    for note in value_notes(sample.dataset, columns):
        yield Remark("worth", Severity.DOUBT, note)
    yield from _check_objective(sample)
    yield from _tell_extents(sample)


def _tell_extents(sample: Sample) -> Iterator[Remark]:
    """Of the channels that use least of their bounds, the part that they use."""
    xi = np.stack([episode.xi for episode in sample.usable.values()])
    used = {
        channel.name: float(np.ptp(xi[:, row])) / (channel.high - channel.low)
        for row, channel in enumerate(sample.setup.observation)
    }
    idle = sorted((name for name in used if used[name] < _ROOMY), key=used.__getitem__)[:_NAMED]
    if idle:
        told = ", ".join(f"{name} {used[name]:.0%}" for name in idle)
        yield Remark(
            "worth",
            Severity.FACT,
            f"of their bounds use least: {told}; bounds twice as wide as what is seen are wide enough",
        )


def _check_objective(sample: Sample) -> Iterator[Remark]:
    f = np.array([episode.f for episode in sample.usable.values()])
    low, high = sample.setup.objective_limits
    outside = float(np.mean((f < low) | (f > high)))
    yield Remark(
        "worth",
        Severity.FACT,
        f"objectives reach from {f.min():.3g} to {f.max():.3g}: {(f > sample.setup.success).mean():.0%} of "
        f"them above success, {sample.setup.success:g}, and {outside:.0%} outside objective_limits [{low:g}, "
        f"{high:g}]; a few of a hundred should succeed, and hardly one lie outside",
    )
    if outside > 0.5:
        yield Remark(
            "worth",
            Severity.DOUBT,
            f"{outside:.0%} of the objectives lie outside objective_limits [{low:g}, {high:g}], which "
            f"Bayesian optimisation sees as 0 and 1: they reach from {f.min():.3g} to {f.max():.3g}; set the "
            "limits by them",
        )
    if sample.setup.success >= high:
        yield Remark(
            "worth",
            Severity.DOUBT,
            f"success is {sample.setup.success:g}, and the upper of objective_limits {high:g}: nothing "
            "within the limits counts as solved; lower success, or raise the limit",
        )
    elif f.min() > sample.setup.success:
        yield Remark(
            "worth",
            Severity.DOUBT,
            f"every random controller succeeds: the least objective is {f.min():.3g}, success "
            f"{sample.setup.success:g}; there is nothing to be learnt, raise success or make the task harder",
        )


def check_angles(sample: Sample) -> Iterator[Remark]:
    """No angle jumps from one end of its range to the other."""
    for index, channel in enumerate(sample.setup.observation):
        rows = [episode.xi[index] for episode in sample.usable.values()]
        if channel.unit == "rad" and any(np.abs(np.diff(row)).max(initial=0) > _JUMP for row in rows):
            yield Remark(
                "angles",
                Severity.DOUBT,
                f"channel {channel.name} jumps by more than π within a step: a model takes that for motion; "
                "give sine and cosine instead, or unwrap it",
            )


def check_cost(sample: Sample) -> Iterator[Remark]:
    """Say what episodes cost."""
    episodes = len(sample.episodes)
    size = sample.report.size / episodes
    yield Remark(
        "cost",
        Severity.FACT,
        f"{1e3 * sample.seconds:.3g} ms and {size / 1e3:.3g} kB an episode, so 500,000 take "
        f"{500_000 * sample.seconds / 3600:.3g} core-hours and {500_000 * size / 1e9:.3g} GB",
    )
