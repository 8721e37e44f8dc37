"""One point of a sweep: train a model in this process, measure it, and try it out on recorded episodes."""

from dataclasses import asdict, dataclass
from typing import Any

import torch
from ray import tune

from cluster.training_job import TrainingJob, episodes, trained_alone
from cluster.training_record import read_json, write_json
from svaedc import diagnostics
from svaedc.offline import Recorded, worth
from workers import setups

RESULT = "result.json"
RUNS, TRIALS = 20, 10
METHODS = ("svae-dc", "screened-random")
"""The first uses latent paths and badness, the second only badness: a model may be good at one of them."""
CANDIDATES = 2_000


@dataclass(frozen=True)
class Point:
    """A named point and its job."""

    name: str
    job: TrainingJob

    @property
    def result(self) -> dict[str, Any]:
        """What was found; empty before."""
        return read_json(self.job.model / RESULT)


def run_point(config: dict[str, Any]) -> None:
    """What Ray Tune runs.

    Args:
        config: the `point`.
    """
    torch.set_num_threads(1)
    point: Point = config["point"]
    result = measured(point)
    write_json(point.job.model / RESULT, result)
    tune.report({"best": result["svae-dc"]["best"]})


def measured(point: Point) -> dict[str, Any]:
    """The diagnostics of a point's model, and its worth for each of `METHODS`."""
    job = point.job
    job.model.mkdir(parents=True, exist_ok=True)
    model = trained_alone(job).eval().requires_grad_(requires_grad=False)
    cache = job.data()
    _, held_out = episodes(cache)
    rows = held_out.rows[:CANDIDATES]
    limits = setups.load(job.origin["setup"]).objective_limits
    recorded = Recorded(cache.x[rows], cache.f[rows], limits)
    found = {method: asdict(worth(method, recorded, model.latent_means, RUNS, TRIALS)) for method in METHODS}
    return {"name": point.name, "metrics": diagnostics.evaluate(model, held_out), **found}
