"""Checkpoints come back whole or not at all."""

import errno
import os
import pickle

import pytest
import torch

from svaedc.model import checkpoint

METADATA = {"setup": "franka", "stride": 5, "dataset": "ab12", "versions": {"torch": "2"}}


@pytest.fixture
def path(model, tmp_path):
    checkpoint.save(tmp_path / "model.pt", model, METADATA)
    return tmp_path / "model.pt"


def test_a_loaded_model_predicts_what_the_saved_one_did(path, model, batch):
    loaded, metadata = checkpoint.load(path)
    assert metadata == METADATA
    assert not loaded.training
    model.eval()
    assert torch.equal(loaded.generate(batch.x), model.generate(batch.x))
    assert torch.equal(loaded.latent_means(batch.x)[1], model.latent_means(batch.x)[1])


def test_a_cut_file_is_refused_at_any_length(path):
    whole = path.read_bytes()
    for length in (0, 1, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"model\.pt is damaged"):
            checkpoint.load(path)


def test_a_flipped_bit_is_refused(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"model\.pt is damaged"):
        checkpoint.load(path)


def test_a_file_that_would_run_code_is_refused(path):
    torch.save({"weights": print}, path)
    with pytest.raises(ValueError, match="damaged or not a checkpoint"):
        checkpoint.load(path)


def test_an_object_that_is_no_checkpoint_is_refused(path):
    checkpoint.write(path, {"weights": {}})
    with pytest.raises(ValueError, match="not a model checkpoint of format 1"):
        checkpoint.load(path)
    torch.save([1, 2], path)
    with pytest.raises(ValueError, match="must hold a dictionary, found list"):
        checkpoint.load(path)


def test_weights_that_do_not_fit_the_configuration_are_refused(path):
    content = checkpoint.read(path)
    content["config"]["tau_dim"] = 4
    checkpoint.write(path, content)
    with pytest.raises(ValueError, match="do not fit its own configuration"):
        checkpoint.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"):
        checkpoint.load(tmp_path / "nowhere.pt")


def test_a_checkpoint_of_another_setup_is_refused_with_both_names(path):
    checkpoint.require(path, METADATA, {"setup": "franka", "stride": 5})
    with pytest.raises(ValueError, match="made for setup 'franka', not 'yumi'"):
        checkpoint.require(path, METADATA, {"setup": "yumi"})


def test_a_failed_write_keeps_the_old_checkpoint_and_leaves_no_file_behind(path, model):
    before = path.read_bytes()
    with pytest.raises((pickle.PicklingError, AttributeError, TypeError)):
        checkpoint.save(path, model, {"setup": lambda: None})
    assert path.read_bytes() == before
    assert [each.name for each in path.parent.iterdir()] == ["model.pt"]


def test_a_full_disk_is_named_and_leaves_the_older_checkpoint(path, model):
    before = path.read_bytes()
    path.with_name(f".{path.name}.{os.getpid()}.tmp").symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"cannot write a checkpoint: No space left.*model\.pt") as full:
        checkpoint.save(path, model, METADATA)
    assert full.value.errno == errno.ENOSPC
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == ["model.pt"]
