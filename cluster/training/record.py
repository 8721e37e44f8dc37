"""What remains of a training: its measures, a picture and the run's record; `metrics.json` comes last.

Its presence says that nothing is missing, so whatever interrupts a recording, the next command repeats it.
"""

from pathlib import Path
from typing import Any

from cluster.errors import UserError
from cluster.files import read_json, write_json
from cluster.optimization.models import load_model
from cluster.progress import say
from cluster.rendering.model_frames import write_remarkable
from cluster.tracking import Run, log_model
from cluster.training import figures
from cluster.training.worker import MODEL, TrainingJob, episodes
from svaedc.model import diagnostics
from svaedc.model.svae_dc import SvaeDc
from workers.dataset.cache import TrainingCache
from workers.dataset.folder import Dataset

MEASURES = "metrics.json"
FULL_SIZE = 10_000
"""From here on a collapsed model is an error; below, it is expected often enough to be only reported."""


def record(
    job: TrainingJob, cache: TrainingCache, dataset: Dataset, run: Run, moments: int
) -> dict[str, Any]:
    """Measure the model on all held-out episodes and keep what is found.

    Args:
        job: that made the model.
        cache: that it was trained on.
        dataset: of the cache.
        run: of the training.
        moments: in the clip of the model's motions; 0 for none.

    Returns:
        What `metrics.json` holds: `metrics`, `collapsed` ("" or why), `episodes`, and the model's metadata.

    Raises:
        OSError: a file cannot be written.
        UserError: the MLflow store cannot be used.
    """
    _, model, metadata = load_model(job.model / MODEL)
    _, held_out = episodes(cache)
    metrics = diagnostics.evaluate(model, held_out)
    collapsed = diagnostics.collapse(metrics) or ""
    pictures = _pictures(job, model, cache, dataset)
    if moments:
        pictures += write_remarkable(job.model, model, dataset, cache, job.stride, moments)
    summary = {"metrics": metrics, "collapsed": collapsed, "episodes": len(cache.episode), **metadata}
    run.metrics({f"final/{name}": value for name, value in metrics.items()}, step=metadata["update"])
    for picture in pictures:
        run.figure(picture)
    run.file(job.model / MODEL)
    log_model(run, job.model / MODEL, model, step=metadata["update"])
    run.dict("model", summary)
    run.tags({"svaedc.collapsed": collapsed or "no"})
    write_json(job.model / MEASURES, summary)
    say(
        f"{job.model / MODEL}: held-out error against the per-step median {metrics['rec_norm']:.2f} "
        f"reconstructed, {metrics['gen_norm']:.2f} generated from x; correlation of y "
        f"{metrics['corr_y_rec']:.2f} and {metrics['corr_y_gen']:.2f}; {metrics['active_dimensions']:.0f} of "
        f"{model.config.tau_size} latent dimensions active; {run.link}"
    )
    return summary


def _pictures(job: TrainingJob, model: SvaeDc, cache: TrainingCache, dataset: Dataset) -> list[Path]:
    _, held_out = episodes(cache)
    pictures = [
        figures.reconstruction(job.model / "reconstruction.png", model, held_out, dataset.identity),
        figures.latent_space(job.model / "latent-space.png", model, held_out, cache.f[held_out.rows]),
    ]
    if model.config.has_psi:
        pictures.append(figures.badness(job.model / "badness.png", model, held_out))
    return pictures


def read_record(folder: Path, update: int) -> dict[str, Any] | None:
    """Read the measures of the model in a folder.

    Args:
        folder: of the model.
        update: updates after which they must have been recorded.

    Returns:
        What `metrics.json` holds; None where there is none of so many updates.
    """
    summary = read_json(folder / MEASURES)
    return summary if summary.get("update") == update else None


def judge(summary: dict[str, Any], updates: int) -> None:
    """Say what is wrong with a recorded model.

    Args:
        summary: from `record` or `read_record`.
        updates: that the whole training has.

    Raises:
        UserError: a model of a full-size dataset collapsed.
    """
    collapsed, count = summary["collapsed"], summary["episodes"]
    if summary["update"] < updates:
        say(
            f"stopped at the time limit after {summary['update']} of {updates} updates; "
            "the same command goes on"
        )
    if collapsed and count >= FULL_SIZE:
        raise UserError(f"{collapsed}. The checkpoint is kept, but should not be used")
    if collapsed:
        say(f"note, with only {count} episodes: {collapsed}")
