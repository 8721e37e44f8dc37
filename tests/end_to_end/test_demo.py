"""The whole pipeline at a small size: everything is there at its end, and a second time repeats nothing."""

import json

import pyarrow.parquet as pq

from cluster.config import CollectSettings, CompareSettings, Settings, TrainSettings
from cluster.demo import DemoSize, demo
from cluster.tracking import open_tracker
from svaedc.model import checkpoint
from workers.dataset.folder import open_dataset
from workers.dataset.verification import verify

SIZE = DemoSize(episodes=256, updates=60, methods=("random", "svae-dc"), runs=2, trials=3)


def test_the_demo_leaves_every_result_and_a_second_one_repeats_nothing(
    ray_session, tracking_settings, tmp_path, capsys
):
    settings = Settings(
        collect=CollectSettings(actors=2, episodes_per_shard=64),
        train=TrainSettings(threads=2, moments=0),
        compare=CompareSettings(slots=2, pool_size=200),
    )
    tracker = open_tracker(tracking_settings)
    comparison = demo(tmp_path, settings, ray_session, tracker, SIZE)
    said = capsys.readouterr().err

    dataset = open_dataset(tmp_path / "dataset")
    assert dataset.episodes() == 256
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    _, metadata = checkpoint.load(tmp_path / "model" / "model.pt")
    assert metadata["dataset"] == dataset.fingerprint()
    trials = pq.read_table(tmp_path / "comparison" / "trials.parquet").to_pylist()
    assert len(trials) == 2 * 2 * (2 + 3)
    assert (tmp_path / "comparison" / "figure.png").stat().st_size > 10_000

    runs = {run.info.run_id: run for run in tracker.client.search_runs([tracker.experiment])}
    kinds = sorted(run.data.tags["svaedc.kind"] for run in runs.values())
    assert kinds == [*("child",) * 4, "collect", "compare", "train"]
    assert {run.info.status for run in runs.values()} == {"FINISHED"}
    compared = runs[comparison.url.rpartition("/")[2]]
    assert compared.data.tags["svaedc.kind"] == "compare"
    children = [run for run in runs.values() if run.data.tags["svaedc.kind"] == "child"]
    assert {run.data.tags["mlflow.parentRunId"] for run in children} == {compared.info.run_id}

    end = said[said.index("svae-dc against random: best objective") :]
    collapsed = json.loads((tmp_path / "model" / "metrics.json").read_text())["collapsed"]
    assert (f"Note, at this size: {collapsed}" in end) == bool(collapsed)
    for named in ("comparison/figure.png", "dataset", "model/model.pt"):
        assert str(tmp_path / named) in end
    assert comparison.url in end

    kept = [path for path in tmp_path.rglob("*") if path.suffix in {".parquet", ".pt", ".jsonl", ".png"}]
    before = {path: path.stat().st_mtime_ns for path in kept}
    again = demo(tmp_path, settings, ray_session, tracker, SIZE)
    assert again == comparison
    assert before == {path: path.stat().st_mtime_ns for path in before}
    assert len(tracker.client.search_runs([tracker.experiment])) == len(runs)
    assert capsys.readouterr().err.endswith(end)
