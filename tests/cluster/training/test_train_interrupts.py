"""What a training survives: Ctrl-C, the death of its process, the death of its driver."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.cluster.training.small import same, weights


def command(dataset: Path, model: Path, root: Path) -> list[str]:
    return [
        *(sys.executable, "-m", "cluster", "train", "--dataset", str(dataset), "--model", str(model)),
        *("--set", "train.updates=500", "--set", "train.threads=1", "--set", "train.moments=0"),
        *(
            "--set",
            f"train.cache_folder={root / 'cache'}",
            "--set",
            f"tracking.uri=sqlite:///{root / 'mlflow.db'}",
        ),
    ]


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 240
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_training_says_that_it_goes_on_and_nothing_else(
    franka_dataset, tmp_path, number, code
):
    line = command(franka_dataset, tmp_path / "model", tmp_path)
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        wait_for(tmp_path / "model" / "training.pt", process)
        # Ctrl-C reaches every process of the terminal, SIGTERM only the one it is meant for.
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
        _, told = process.communicate(timeout=300)
    assert process.returncode == code, told
    lines = [each for each in told.splitlines() if " updates, " not in each and "training " not in each]
    assert lines == ["stopped: everything finished is kept, and the same command goes on from here"]
    assert not (tmp_path / "model" / "metrics.json").exists()


@pytest.mark.slow
def test_killing_the_training_process_or_the_driver_changes_nothing(franka_dataset, tmp_path):
    undisturbed = command(franka_dataset, tmp_path / "undisturbed", tmp_path)
    subprocess.run(undisturbed, check=True, capture_output=True)
    for victim in ("worker", "driver"):
        line = command(franka_dataset, tmp_path / victim, tmp_path)
        with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            wait_for(tmp_path / victim / "training.pt", process)
            if victim == "driver":
                process.kill()
            else:
                children = psutil.Process(process.pid).children(recursive=True)
                [rank] = [child for child in children if "RayTrainWorker" in " ".join(child.cmdline())]
                os.kill(rank.pid, signal.SIGKILL)
            process.communicate(timeout=400)
        if victim == "driver":
            subprocess.run(line, check=True, capture_output=True)
        assert same(*(weights(tmp_path / name / "model.pt") for name in ("undisturbed", victim))), victim
