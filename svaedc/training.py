"""Training as a generator of epoch reports: the core yields, the shell logs and saves."""

from collections.abc import Callable, Iterator

from torch import nn

from svaedc.episodes import Episodes
from svaedc.epochs import STAGES, EpochReport, Loop, Run, TrainingState, require_settings
from svaedc.model import SvaeDc
from svaedc.sampling import ALONE, Shard
from svaedc.settings import TrainingSettings

__all__ = ["EpochReport", "TrainingState", "fit", "require_settings"]


def _unchanged(module: nn.Module) -> nn.Module:
    return module


def fit(
    model: SvaeDc,
    training: Episodes,
    held_out: Episodes,
    settings: TrainingSettings,
    resume: TrainingState | None = None,
    shard: Shard = ALONE,
    parallelise: Callable[[nn.Module], nn.Module] = _unchanged,
) -> Iterator[EpochReport]:
    """Train `model` in place, on the device of its parameters, and report after every epoch.

    Randomness is a function of (seed, stage, epoch, rank) alone, and torch's own generator is left as it was,
    so an interrupted run that resumes ends with the same bits as one that was not.

    Args:
        model: From `initialised`.
        training: All workers' training episodes; `shard` selects this worker's.
        held_out: Measured after every epoch; they also select stage two's network.
        settings: The run.
        resume: `EpochReport.state` of an earlier run with the same settings, or None for a new run. A
            finished run yields nothing more.
        shard: This worker among those that train together.
        parallelise: Wraps what each stage optimises, for example in DistributedDataParallel.

    Raises:
        ValueError: `resume` comes from other settings, or there are too few episodes.
        FloatingPointError: The loss is no longer finite.
    """
    run = Run(model, training, held_out, settings, shard)
    begun, epochs = STAGES[0], 0
    if resume is not None:
        run.load(resume)
        begun, epochs = resume["stage"], resume["epoch"]
    for name in STAGES[STAGES.index(begun) :]:
        done = epochs if name == begun else 0
        if done * settings.epoch_updates >= run.budget(name):
            continue
        stage = run.stage(name)
        loop = Loop(run, stage, parallelise(stage.module))
        if resume is not None and done:
            loop.load(resume)
        yield from loop.epochs(done)
