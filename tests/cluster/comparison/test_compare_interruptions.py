"""A comparison that is interrupted goes on trial by trial, to the same table."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cluster.comparison.records import RunKey, append, read_trials
from cluster.errors import UserError
from tests.cluster.comparison.comparing import mlflow_runs, table, trial


@pytest.mark.slow
def test_an_interrupted_comparison_goes_on_trial_by_trial_to_the_same_table(compared):
    whole = table(compared())
    out = compared()
    path = RunKey("se", 1001).path(out)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]) + lines[3][:40])
    RunKey("random", 1000).path(out).unlink()
    assert len(read_trials(path)) == 3
    assert table(compared()) == whole


def command(folder: Path) -> list[str]:
    return [
        *(sys.executable, "-m", "cluster", "compare", "--setup", "franka", "--out", str(folder / "out")),
        *("--methods", "random,se", "--runs", "2", "--trials", "8", "--seed", "1000"),
        *("--set", "compare.pool_size=200", "--set", "ray.num_cpus=2"),
        *("--set", f"tracking.uri=sqlite:///{folder / 'store' / 'mlflow.db'}"),
        *("--set", "tracking.experiment=tests"),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_a_comparison_stopped_by_a_signal_goes_on_to_the_same_table(
    number, code, compared, tmp_path, tracking_settings
):
    with subprocess.Popen(
        command(tmp_path), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    ) as process:
        deadline = time.monotonic() + 300
        while not any(path.stat().st_size for path in tmp_path.glob("out/runs/*.jsonl")):
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        if number == signal.SIGINT:  # a terminal sends it to the whole group
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        output, _ = process.communicate(timeout=180)
    assert process.returncode == code, output
    if number != signal.SIGKILL:
        assert output.splitlines() == [
            "stopped: everything finished is kept, and the same command goes on from here"
        ]
    assert not (tmp_path / "out" / "trials.parquet").exists()
    after = table(compared(trials=8))
    [parent], children = mlflow_runs(tracking_settings)
    assert [run.info.status for run in (parent, *children)] == ["FINISHED"] * 5
    assert after == table(compared(trials=8, folder=tmp_path / "whole"))


@pytest.fixture
def disk_with_room_for(tmp_path):
    """Mounts a small file system; the number of bytes is its size."""
    small = tmp_path / "small"
    small.mkdir()

    def mount(size: str) -> Path:
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(small)], check=True)
        return small

    yield mount
    subprocess.run(["umount", "--lazy", str(small)], check=True)


@pytest.mark.slow
@pytest.mark.skipif(os.getuid() != 0, reason="only root may mount a small file system")
def test_a_full_disk_ends_a_comparison_with_nothing_lost(compared, disk_with_room_for, tmp_path):
    small = disk_with_room_for("40k")
    with pytest.raises(UserError, match=r"cannot write to .*No space left on device; make room"):
        compared("random", trials=20, folder=small / "out")
    kept = [found for path in small.glob("out/runs/*") for found in read_trials(path)]
    assert kept
    shutil.copytree(small / "out", tmp_path / "roomy")
    assert table(compared("random", trials=20, folder=tmp_path / "roomy")) == table(
        compared("random", trials=20, folder=tmp_path / "whole")
    )


@pytest.mark.skipif(os.getuid() != 0, reason="only root may mount a small file system")
@pytest.mark.slow
def test_a_disk_too_full_for_the_figure_keeps_the_trials(compared, disk_with_room_for):
    small = disk_with_room_for("64k")
    with pytest.raises(UserError, match=r"cannot write to .*No space left on device; make room"):
        compared("random", runs=1, folder=small / "out")
    assert len(read_trials(RunKey("random", 1000).path(small / "out"))) == 4
    assert not list(small.glob("out/.unfinished*"))
    subprocess.run(["mount", "-o", "remount,size=2m", str(small)], check=True)
    assert len(table(compared("random", runs=1, folder=small / "out"))) == 4
    assert (small / "out" / "figure.svg").exists()


@pytest.mark.slow
def test_runs_that_keep_failing_are_named_with_their_errors_and_cost_no_other_run(compared, capfd):
    out = compared("random", runs=1, trials=5)
    append(RunKey("se", 1000).path(out), trial(0))  # of another controller than the runs of this seed share
    capfd.readouterr()
    with pytest.raises(UserError, match=r"1 of 2 runs kept failing.*ValueError: trial 0 must have tried"):
        compared("se,matern", runs=1, trials=5)
    errors = (out / "errors.txt").read_text()
    assert "loop.py" in errors
    assert {sign for sign in errors if not sign.isprintable()} == {"\n"}
    assert len(read_trials(RunKey("matern", 1000).path(out))) == 7
    assert len(read_trials(RunKey("se", 1000).path(out))) == 1
    said = capfd.readouterr()
    assert said.out == ""
    lines = [line for line in said.err.splitlines() if "best so far" not in line]
    assert lines[:2] == ["run se 1000 failed and is tried again from its last trial"] * 2
    missing = (
        "1 of 2 runs is not whole (7 trials each): se 1000 has 1 trial. `svaedc compare` goes on with them"
    )
    assert missing in lines
    assert "1 of 2 runs is not whole" in (out / "report.html").read_text()
