"""One point of a sweep: train a model in this process, measure it, and try it out on recorded episodes."""

from dataclasses import asdict, dataclass
from math import nan
from typing import Any

import torch
from ray import tune

from cluster.errors import UserError
from cluster.files import read_json, write_json
from cluster.training.worker import MODEL, TrainingJob, episodes, train_alone
from svaedc.bo.offline import Recorded, worth
from svaedc.model import checkpoint, diagnostics
from workers import setups

RESULT = "result.json"
RUNS, TRIALS = 20, 10
METHODS = ("svae-dc", "screened-random")
"""The first uses latent paths and badness, the second only badness: a model may be good at one of them."""
CANDIDATES = 2_000


@dataclass(frozen=True)
class SweepPoint:
    """A named point, its job, and the updates of its whole training."""

    name: str
    job: TrainingJob
    updates: int

    @property
    def result(self) -> dict[str, Any]:
        """What was found; empty before, and where an earlier version did not say what it belongs to.

        Raises:
            UserError: the folder holds what was found for another dataset, seed, preset or budget.
        """
        path = self.job.model / RESULT
        found = read_json(path)
        if "origin" not in found:
            return {}
        made, wanted = ({**of["origin"], "updates": of["updates"]} for of in (found, self._identity()))
        for name, value in wanted.items():
            if made.get(name) != value:
                raise UserError(
                    f"{path} was made for {name} {made.get(name)!r}, not {value!r}; sweep into another "
                    "--model folder, or ask for what this one holds"
                )
        # Measures that are no numbers, such as those of y of an SVAE, are null in the file.
        measures = {key: nan if value is None else value for key, value in found.get("metrics", {}).items()}
        return {**found, "metrics": measures}

    def _identity(self) -> dict[str, Any]:
        return {"name": self.name, "origin": self.job.origin, "updates": self.updates}

    def measure(self) -> dict[str, Any]:
        """The diagnostics of the point's model, which is trained first, and its worth for each of `METHODS`.

        Empty if its time limit ended the training: a point with fewer updates than the others tells nothing.
        """
        job = self.job
        job.model.mkdir(parents=True, exist_ok=True)
        model = train_alone(job).eval().requires_grad_(requires_grad=False)
        reached = checkpoint.load(job.model / MODEL)[1]["update"]
        if reached < self.updates:
            return {}
        cache = job.data()
        _, held_out = episodes(cache)
        rows = held_out.rows[:CANDIDATES]
        limits = setups.load(job.origin["setup"]).objective_limits
        recorded = Recorded(cache.x[rows], cache.f[rows], limits)
        found = {
            method: asdict(worth(method, recorded, model.latent_means, RUNS, TRIALS)) for method in METHODS
        }
        metrics = diagnostics.evaluate(model, held_out)
        return {**self._identity(), "update": reached, "metrics": metrics, **found}


def run_point(config: dict[str, Any]) -> None:
    """What Ray Tune runs.

    Args:
        config: the `point`.
    """
    torch.set_num_threads(1)
    point: SweepPoint = config["point"]
    result = point.measure()
    if result:
        write_json(point.job.model / RESULT, result)
    tune.report({"is_finished": bool(result)})
