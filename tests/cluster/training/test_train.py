"""`svaedc train` on a real cluster, with a dataset small enough for seconds."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from cluster.errors import UserError
from cluster.tracking import open_tracker
from svaedc.model import checkpoint


@pytest.mark.slow
def test_training_leaves_a_model_its_measures_a_picture_and_a_tracked_run(
    run_train, tracking_settings, capsys
):
    before = signal.getsignal(signal.SIGINT)
    path = run_train(moments=1)
    assert signal.getsignal(signal.SIGINT) is before
    model, metadata = checkpoint.load(path)
    assert metadata["setup"] == "franka"
    assert metadata["update"] == 40
    assert model.latent_means(torch.rand(3, 48))[0].shape == (3, 9)
    measured = json.loads((path.parent / "metrics.json").read_text())
    assert {"rec_norm", "gen_norm", "corr_y_rec", "active_dimensions"} <= measured["metrics"].keys()
    assert (path.parent / "reconstruction.png").stat().st_size > 10_000
    client = open_tracker(tracking_settings).client
    [run] = client.search_runs(["1"])
    steps = [point.step for point in client.get_metric_history(run.info.run_id, "held_out/gen_norm")]
    assert steps == [20, 40]
    assert run.inputs.dataset_inputs[0].dataset.name == "franka"
    assert {artifact.path for artifact in client.list_artifacts(run.info.run_id)} >= {"figures", "model.pt"}
    figures = {artifact.path for artifact in client.list_artifacts(run.info.run_id, "figures")}
    assert figures >= {"figures/motions.gif", "figures/motions.png"}
    assert run.data.tags["svaedc.device"] == "cpu (1 threads), float32"
    while_it_trains = ("log_p_xi", "log_p_y", "log_p_latent", "minus_log_q", "mae_y_gen", "latent_spread/08")
    assert {f"held_out/{name}" for name in while_it_trains} <= run.data.metrics.keys()
    assert run.data.metrics["train/trajectories_per_second"] > 0.0
    assert run.data.metrics["train/learning_rate"] > 0.0
    assert (run.data.params["stride"], run.data.params["updates"]) == ("5", "40")
    capsys.readouterr()
    assert run_train() == path
    assert "nothing to do" in capsys.readouterr().err
    assert sorted(file.name for file in path.parent.iterdir()) == [
        "badness.png",
        "latent-space.png",
        "metrics.json",
        "model.pt",
        "motions.gif",
        "motions.png",
        "reconstruction.png",
        "run.json",
        "training.pt",
    ]


@pytest.mark.slow
def test_two_processes_learn_what_one_does(run_train):
    measured = [
        json.loads((run_train(f"{count}", workers=count).parent / "metrics.json").read_text())["metrics"]
        for count in (1, 2)
    ]
    assert measured[0]["rec_norm"] == pytest.approx(measured[1]["rec_norm"], rel=0.1)


@pytest.mark.slow
def test_the_model_in_mlflow_answers_in_a_fresh_process_without_the_package(
    run_train, finished, tracking_settings, tmp_path
):
    finished.with_name("metrics.json").unlink()
    run_train()
    [model] = open_tracker(tracking_settings).client.search_logged_models(["1"])
    x = np.random.default_rng(0).random((3, 48), dtype=np.float32)
    np.save(tmp_path / "x.npy", x)
    script = f"""
import mlflow, numpy, sys
mlflow.set_tracking_uri({tracking_settings.uri!r})
answer = mlflow.pyfunc.load_model("models:/{model.model_id}").predict(numpy.load("x.npy"))
import svaedc
assert "mlruns" in svaedc.__file__, svaedc.__file__
numpy.savez("answer.npz", **answer)
"""
    subprocess.run([sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True)
    answer = np.load(tmp_path / "answer.npz")
    tau, y = checkpoint.load(finished)[0].latent_means(torch.from_numpy(x))
    np.testing.assert_allclose(answer["tau"], tau.detach(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(answer["y"], y.detach(), rtol=1e-5)


@pytest.mark.slow
def test_the_choices_of_a_preset_can_be_changed_and_belong_to_the_model_s_origin(run_train):
    path = run_train(model="svae", distribution="gaussian", latent="5x6", balance="f", updates=3)
    model, metadata = checkpoint.load(path)
    assert (model.config.psi_dim, model.config.distribution, model.config.tau_size) == (0, "gaussian", 30)
    assert model.config.channels == (64, 128, 256)
    assert metadata["balance"] == "f"
    assert metadata["changes"].items() >= {"model": "svae", "latent": "5x6"}.items()
    assert not (path.parent / "badness.png").exists()
    with pytest.raises(UserError, match="was made for balance 'f', not 'none'"):
        run_train(updates=3)


@pytest.mark.slow
def test_an_elastic_training_starts_with_the_processes_there_is_room_for(run_train, capsys):
    path = run_train(workers=64, least_workers=1)
    assert checkpoint.load(path)[1]["update"] == 40
    assert "64 processes (or as few as 1)" in capsys.readouterr().err


@pytest.mark.slow
def test_a_relative_cache_folder_is_the_driver_s(run_train, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    run_train(cache=Path("near"))
    assert len(list((tmp_path / "near").glob("*-stride5"))) == 1


@pytest.mark.slow
def test_a_training_may_read_plans(run_train):
    path = run_train("reader", prior="plan", updates=4, epoch_updates=2)
    model, metadata = checkpoint.load(path)
    assert (model.config.prior, model.config.plan_channels) == ("plan", 13)
    assert metadata["changes"]["prior"] == "plan"
    assert json.loads((path.parent / "metrics.json").read_text())["metrics"]["gen_norm"] > 0.0
