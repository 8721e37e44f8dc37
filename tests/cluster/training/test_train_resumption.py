"""A training that ended early goes on from there, and a finished one is not repeated."""

import json

import pytest

from cluster.errors import UserError
from cluster.tracking import open_tracker
from cluster.training.train import working_in
from svaedc.model import checkpoint
from tests.cluster.training.small import same, weights

pytestmark = pytest.mark.slow  # they need trainings that ended in several ways


def test_training_stops_at_its_time_limit_and_goes_on_from_there(run_train, half_way, ends):
    assert checkpoint.load(half_way)[1]["update"] == 20
    path = run_train()
    assert checkpoint.load(path)[1]["update"] == 40
    assert json.loads(path.with_name("metrics.json").read_text())["update"] == 40
    assert same(weights(path), weights(ends["finished"] / "model.pt"))


def test_a_training_that_has_no_room_to_go_on_is_tracked_by_no_new_run(
    run_train, half_way, tracking_settings
):
    with pytest.raises(UserError, match="needs 8 CPUs"):
        run_train(workers=2, threads=4)
    assert half_way.exists()
    assert open_tracker(tracking_settings).client.search_runs(["1"]) == []


def test_two_trainings_at_once_in_one_folder_are_refused(run_train, finished):
    with (
        working_in(finished.parent),
        pytest.raises(UserError, match=r"another training is at work in .*/model; wait for its end"),
    ):
        run_train()
    assert run_train() == finished


def test_a_training_that_died_before_its_last_file_still_leaves_a_model(run_train, finished):
    before = weights(finished)
    finished.unlink()
    assert same(before, weights(run_train()))


def test_other_updates_than_the_training_began_with_are_refused_naming_both(run_train, half_way):
    assert half_way.exists()
    with pytest.raises(UserError, match=r"joint\.updates was 40, is 50; .* another --model folder"):
        run_train(updates=50)


def test_a_finished_model_is_not_trained_over(run_train, finished):
    finished.with_name("training.pt").unlink()
    assert run_train() == finished
    with pytest.raises(UserError, match="trained for 40 updates, not 50"):
        run_train(updates=50)


def test_training_goes_on_in_another_tracking_store_as_a_new_run(run_train, half_way, tracking_settings):
    before = json.loads(half_way.with_name("run.json").read_text())["run"]
    path = run_train()
    [run] = open_tracker(tracking_settings).client.search_runs(["1"])
    assert run.info.run_id == json.loads(path.with_name("run.json").read_text())["run"] != before
    assert checkpoint.load(path)[1]["update"] == 40


def test_a_folder_with_a_model_of_another_origin_is_refused(run_train, finished):
    with pytest.raises(UserError, match="made for stride 5, not 10"):
        run_train(stride=10)
    assert finished.exists()


def test_a_damaged_checkpoint_is_named(run_train, finished):
    finished.unlink()
    finished.with_name("training.pt").write_bytes(b"half a file")
    with pytest.raises(UserError, match=r"training\.pt is damaged"):
        run_train()
