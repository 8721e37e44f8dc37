"""A checkpoint as an MLflow model, which loads back in any process: x in, latent path and badness out."""

import shutil
import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
import torch
from mlflow.entities import LoggedModelOutput

import svaedc
from cluster.tracking.latent_means import PLAN
from cluster.tracking.runs import Run
from svaedc.model.checkpoint import FILE
from svaedc.model.networks import PlanOf
from svaedc.model.svae_dc import SvaeDc

NAME: Final = "latent-means"
_CODE: Final = Path(__file__).with_name("latent_means.py")
_NEEDED: Final = ("mlflow", "torch", "numpy", "jaxtyping")


def log_model(run: Run, checkpoint: Path, model: SvaeDc, step: int) -> str:
    """Keeps a checkpoint as a model of the run.

    The model carries the `svaedc` package with it, and what computes plans where it reads them, so it answers
    as it did today whatever is installed later.

    Args:
        run: that trained it.
        checkpoint: its file.
        model: what it holds.
        step: updates behind it.

    Returns:
        The address for `mlflow.pyfunc.load_model`.

    Raises:
        UserError: the store cannot be written.
    """
    tracker = run.tracker
    with tempfile.TemporaryDirectory(prefix="svaedc-model-") as folder, tracker.reaching():
        _save(Path(folder), checkpoint, model)
        logged = tracker.client.create_logged_model(tracker.experiment, NAME, source_run_id=run.id)
        tracker.client.log_model_artifacts(logged.model_id, str(Path(folder) / NAME))
        tracker.client.finalize_logged_model(logged.model_id, "READY")
        tracker.client.log_outputs(run.id, [LoggedModelOutput(logged.model_id, step)])
    return f"models:/{logged.model_id}"


def _save(folder: Path, checkpoint: Path, model: SvaeDc) -> None:
    data = folder / "data"
    data.mkdir()
    shutil.copy(checkpoint, data / FILE)
    if model.reads_plans:
        _trace_plan(model, data / PLAN)
    with warnings.catch_warnings():
        # What MLflow says of its own type hints while it is imported is no business of the user's.
        warnings.simplefilter("ignore")
        from mlflow import pyfunc
        from mlflow.models import ModelSignature
        from mlflow.types import Schema, TensorSpec

        kind = np.dtype(np.float32)
        inputs = Schema([TensorSpec(kind, (-1, model.config.controller_dim))])
        outputs = Schema([TensorSpec(kind, (-1, model.config.tau_size), "tau"), TensorSpec(kind, (-1,), "y")])
        pyfunc.save_model(
            str(folder / NAME),
            loader_module=_CODE.stem,
            data_path=str(data),
            code_paths=[str(_CODE), str(Path(svaedc.__file__).parent)],
            pip_requirements=[f"{name}=={version(name)}" for name in _NEEDED],
            signature=ModelSignature(inputs, outputs),
        )


class _Plan(torch.nn.Module):
    """What computes the plans of a model, as a module that can be traced."""

    def __init__(self, plan_of: PlanOf) -> None:
        super().__init__()
        self._plan_of = plan_of

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self._plan_of(x)


def _trace_plan(model: SvaeDc, path: Path) -> None:
    """Keep the computation alone, for any number of controllers, without the code that it is from.

    `torch.export`, which is to replace tracing, takes three minutes for the thousands of steps of a gait.
    """
    example = torch.full((2, model.config.controller_dim), 0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        traced = torch.jit.trace(_Plan(model.known_plan_of()), (example,), check_trace=False)
        torch.jit.save(traced, path)
