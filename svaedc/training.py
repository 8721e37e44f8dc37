"""Training as a generator of epoch reports: the core yields, the shell logs and saves."""

from collections.abc import Iterator

from svaedc.episodes import Episodes
from svaedc.epochs import STAGES, EpochReport, Loop, Run, TrainingState, require_settings
from svaedc.model import SvaeDc
from svaedc.sampling import Order, uniform
from svaedc.settings import TrainingSettings
from svaedc.workplace import ALONE_AT_WORK, Workplace

__all__ = ["EpochReport", "TrainingState", "fit", "require_settings"]


def fit(
    model: SvaeDc,
    training: Episodes,
    held_out: Episodes,
    settings: TrainingSettings,
    resume: TrainingState | None = None,
    order: Order = uniform,
    workplace: Workplace = ALONE_AT_WORK,
) -> Iterator[EpochReport]:
    """Train `model` in place, on the device of its parameters, and report after every epoch.

    Randomness is a function of (seed, stage, epoch, rank) alone, and torch's own generator is left as it was,
    so an interrupted run that resumes ends with the same bits as one that was not.

    Args:
        model: From `initialised`.
        training: All workers' training episodes; the workplace's shard selects this worker's.
        held_out: Measured after every epoch; they also select stage two's network.
        settings: The run.
        resume: `EpochReport.state` of an earlier run with the same settings, or None for a new run. A
            finished run yields nothing more.
        order: Of the training episodes in each pass.
        workplace: Who trains with this process, and in which precision.

    Raises:
        ValueError: `resume` comes from other settings, or there are too few episodes.
        FloatingPointError: The loss is no longer finite.
    """
    run = Run(model, training, held_out, settings, order, workplace)
    if resume is not None:
        run.load(resume)
    for name in _left(settings, resume):
        stage = run.stage(name)
        loop = Loop(run, stage, workplace.parallelise(stage.module))
        done = 0
        if resume is not None and resume["stage"] == name:
            loop.load(resume)
            done = resume["epoch"]
        yield from loop.epochs(done)


def _left(settings: TrainingSettings, resume: TrainingState | None) -> list[str]:
    """Stages with a budget that are not over, in order."""
    first = 0
    if resume is not None:
        first = STAGES.index(resume["stage"]) + int(resume["is_over"])
    return [name for name in STAGES[first:] if getattr(settings, name).updates]
