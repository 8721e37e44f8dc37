"""The front door in Python: light to import, complete, and worth as much as the command line."""

import math
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import svaedc
from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.worker import ComparisonJob
from cluster.errors import UsageError, UserError
from workers import setups
from workers.attempts import Attempts

NOTEBOOK = Path(__file__).parents[2] / "examples" / "ten_trials.ipynb"
SETUP = "quadratic-30d"


def optimizer(**changes) -> "svaedc.Optimizer":
    return svaedc.Optimizer(SETUP, **{"method": "se", "seed": 1000, "pool_size": 60, **changes})


def tell(asked: "svaedc.Optimizer", trials: int) -> None:
    with svaedc.simulated_robot(SETUP, seed=1000) as robot:
        while len(asked.trials) < trials:
            x = asked.ask()
            outcome = robot(x)
            asked.tell(x, outcome.f, outcome.y)


def test_importing_it_loads_neither_torch_nor_ray_and_says_the_version():
    program = (
        "import sys, svaedc; heavy = {'torch', 'ray', 'numpy', 'mlflow', 'cluster'}; "
        "print(svaedc.__version__, sorted(heavy & sys.modules.keys()))"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert said.stdout.split() == [svaedc.__version__, "[]"]


def test_every_name_that_it_offers_is_there():
    assert {name: getattr(svaedc, name) for name in svaedc.__all__}
    assert set(svaedc.__all__) <= set(dir(svaedc))
    with pytest.raises(AttributeError, match="no attribute 'optimiser'; it offers Dataset, Optimizer"):
        getattr(svaedc, "optimiser")  # noqa: B009


def test_the_optimiser_asks_for_what_the_comparison_of_its_seed_tries(tmp_path):
    asked = optimizer()
    tell(asked, 5)
    (tmp_path / "runs").mkdir()
    job = ComparisonJob(ComparisonFolder(tmp_path), SETUP, "paper", (), pool_size=60, initial=2, trials=3)
    setup = setups.load(SETUP)
    with Attempts(setup) as attempts:
        run = list(job.run(RunKey("se", 1000), setup, attempts))
    assert [trial.x.tobytes() for trial in asked.trials] == [trial.x.tobytes() for trial in run]
    assert [(trial.f, trial.best, trial.status) for trial in asked.trials] == [
        (trial.f, trial.best, trial.status) for trial in run
    ]


def test_an_optimiser_goes_on_from_its_file_and_from_its_history(tmp_path):
    asked = optimizer(file=tmp_path / "deep" / "trials.jsonl")
    tell(asked, 4)
    from_file, from_history = (
        optimizer(file=tmp_path / "deep" / "trials.jsonl"),
        optimizer(trials=asked.trials),
    )
    for again in (from_file, from_history):
        assert len(again.trials) == 4
        np.testing.assert_array_equal(again.ask(), asked.ask())
        assert again.best.f == asked.best.f


def test_a_failed_trial_is_kept_teaches_nothing_and_is_not_asked_for_again():
    asked = optimizer(pool_size=3)
    for value in (1.0, 2.0, math.nan):
        asked.tell(asked.ask(), value)
    assert [trial.status for trial in asked.trials] == ["ok", "ok", "failed"]
    assert asked.trials[2].best == 2.0
    assert not np.array_equal(asked.ask(), asked.trials[2].x)


def test_what_cannot_be_told_is_refused_with_the_value():
    asked = optimizer()
    with pytest.raises(ValueError, match=r"got \(3,\)"):
        asked.tell(np.zeros(3), 1.0)
    with pytest.raises(ValueError, match=r"y must lie in \[0, 1\].* got 2"):
        asked.tell(asked.ask(), 1.0, 2.0)
    assert asked.trials == ()


def test_a_method_or_a_setup_that_does_not_exist_is_named():
    with pytest.raises(UsageError, match="did you mean"):
        svaedc.Optimizer(SETUP, "svae-cd")
    with pytest.raises(UsageError, match="needs a trained model"):
        svaedc.Optimizer(SETUP, "svae-dc")
    with pytest.raises(UsageError, match="did you mean 'franka'"):
        svaedc.load_setup("frnka")
    with pytest.raises(UserError, match="holds no dataset"):
        svaedc.open_dataset("/nowhere/at/all")


@pytest.mark.documentation
def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    NotebookClient(notebook, timeout=400, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    printed = "".join(output.get("text", "") for output in outputs if output.output_type == "stream")
    assert "trial 5: f" in printed
    assert notebook.cells[-1].outputs[0].data["text/plain"].startswith("(6, ")
