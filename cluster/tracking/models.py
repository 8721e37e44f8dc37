"""A checkpoint as an MLflow model, which loads back in any process: x in, latent path and badness out."""

import tempfile
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
from mlflow.entities import LoggedModelOutput

import svaedc
from cluster.tracking.runs import Run

NAME: Final = "latent-means"
_CODE: Final = Path(__file__).with_name("latent_means.py")
_NEEDED: Final = ("mlflow", "torch", "numpy", "jaxtyping")


def log_model(run: Run, checkpoint: Path, controller_dim: int, tau_size: int, step: int) -> str:
    """Keeps a checkpoint as a model of the run.

    The model carries the `svaedc` package with it, so it answers as it did today whatever is installed later.

    Args:
        run: that trained it.
        checkpoint: its file.
        controller_dim: D of x.
        tau_size: of the flattened latent path.
        step: updates behind it.

    Returns:
        The address for `mlflow.pyfunc.load_model`.

    Raises:
        UserError: the store cannot be written.
    """
    tracker = run.tracker
    with tempfile.TemporaryDirectory(prefix="svaedc-model-") as folder, tracker.reaching():
        _save(Path(folder) / NAME, checkpoint, controller_dim, tau_size)
        model = tracker.client.create_logged_model(tracker.experiment, NAME, source_run_id=run.id)
        tracker.client.log_model_artifacts(model.model_id, str(Path(folder) / NAME))
        tracker.client.finalize_logged_model(model.model_id, "READY")
        tracker.client.log_outputs(run.id, [LoggedModelOutput(model.model_id, step)])
    return f"models:/{model.model_id}"


def _save(folder: Path, checkpoint: Path, controller_dim: int, tau_size: int) -> None:
    with warnings.catch_warnings():
        # What MLflow says of its own type hints while it is imported is no business of the user's.
        warnings.simplefilter("ignore")
        from mlflow import pyfunc
        from mlflow.models import ModelSignature
        from mlflow.types import Schema, TensorSpec

        kind = np.dtype(np.float32)
        inputs = Schema([TensorSpec(kind, (-1, controller_dim))])
        outputs = Schema([TensorSpec(kind, (-1, tau_size), "tau"), TensorSpec(kind, (-1,), "y")])
        pyfunc.save_model(
            str(folder),
            loader_module=_CODE.stem,
            data_path=str(checkpoint),
            code_paths=[str(_CODE), str(Path(svaedc.__file__).parent)],
            pip_requirements=[f"{name}=={version(name)}" for name in _NEEDED],
            signature=ModelSignature(inputs, outputs),
        )
