"""What is recorded of a finished training, and what is said of a collapsed model."""

import json

import pytest

from cluster.errors import UserError
from cluster.training.record import judge


def test_a_model_that_is_not_finished_says_that_the_command_goes_on(capsys):
    judge({"collapsed": "", "episodes": 240, "update": 40}, updates=80)
    assert "after 40 of 80 updates; the same command goes on" in capsys.readouterr().err


@pytest.mark.slow
def test_a_training_that_died_before_its_last_record_only_repeats_the_record(run_train, finished, capsys):
    measures = finished.with_name("metrics.json")
    written, trained_at = measures.read_text(), finished.stat().st_mtime_ns
    measures.unlink()
    run_train()
    assert measures.read_text() == written
    assert finished.stat().st_mtime_ns == trained_at
    assert "held-out error" in capsys.readouterr().err


@pytest.mark.slow
def test_a_full_disk_while_recording_is_named_and_loses_nothing(run_train, finished):
    finished.with_name("metrics.json").unlink()
    finished.with_name(".unfinished-metrics.json").symlink_to("/dev/full")
    with pytest.raises(UserError, match=r"No space left on device.*run the same command"):
        run_train()
    assert finished.exists()
    assert run_train().with_name("metrics.json").exists()


@pytest.mark.slow
def test_a_collapsed_model_of_a_full_size_dataset_is_refused_every_time(run_train, finished):
    measures = finished.with_name("metrics.json")
    summary = json.loads(measures.read_text())
    measures.write_text(json.dumps({**summary, "collapsed": "the model collapsed: x", "episodes": 10_000}))
    for _ in range(2):
        with pytest.raises(UserError, match=r"the model collapsed: x\. The checkpoint is kept"):
            run_train()


def test_a_collapsed_model_of_a_small_dataset_is_only_a_note(capsys):
    judge({"collapsed": "the model collapsed: x", "episodes": 9_999, "update": 80}, updates=80)
    assert "with only 9999 episodes: the model collapsed: x" in capsys.readouterr().err
