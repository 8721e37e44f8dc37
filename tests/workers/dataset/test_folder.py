"""A folder is one dataset for ever."""

import json
from dataclasses import replace

import pytest

from workers import setups
from workers.dataset.folder import MANIFEST, create, open_dataset
from workers.dataset.identity import Identity, identity_of


def test_identity_survives_json(identity):
    assert Identity.from_json(identity.to_json()) == identity
    assert Identity.from_json(identity.to_json()).digest == identity.digest


def test_identity_of_a_setup_is_complete(tmp_path):
    identity = identity_of(setups.load("franka"), seed=1, episodes_per_shard=256)
    assert create(tmp_path / "new", identity).identity == identity
    assert len(identity.parameters) == 48
    assert identity.physics["object1_mass"] == pytest.approx((1.9, 2.1))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("setup", "yumi"),
        ("seed", 6),
        ("horizon", 21),
        ("episodes_per_shard", 16),
        ("physics", {"mass": (1.0, 2.1), "friction": (0.2, 0.4)}),
        ("conditions", ("tipped",)),
        ("rollout_version", 2),
        ("numpy", "3"),
    ],
)
def test_another_identity_is_refused_naming_the_field(dataset, identity, field, value):
    with pytest.raises(ValueError, match=f"differ in {field}: "):
        create(dataset.folder, replace(identity, **{field: value}))


def test_the_first_of_two_creators_wins(tmp_path, identity):
    first = create(tmp_path / "d", identity)
    content = (first.folder / MANIFEST).read_bytes()
    again = create(tmp_path / "d", identity)
    assert again == first
    assert (first.folder / MANIFEST).read_bytes() == content
    assert list((first.folder / ".writing").iterdir()) == []


def test_a_folder_without_a_dataset_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"holds no dataset: there is no dataset\.json"):
        open_dataset(tmp_path)


@pytest.mark.parametrize("content", ["", "{", "[]", "3", '{"setup": "franka"}', '{"parameters": 1}'])
def test_a_damaged_manifest_is_refused_by_name(tmp_path, content):
    (tmp_path / MANIFEST).write_text(content)
    with pytest.raises(ValueError, match=r"dataset\.json is damaged"):
        open_dataset(tmp_path)


def test_a_lost_manifest_is_written_anew_for_what_the_shards_hold_and_for_nothing_else(dataset, identity):
    manifest = dataset.folder / MANIFEST
    content = manifest.read_bytes()
    manifest.unlink()
    with pytest.raises(ValueError, match=r"lost its dataset\.json, and episodes-.* differ in seed: 5 and 6"):
        create(dataset.folder, replace(identity, seed=6))
    assert not manifest.exists()
    assert create(dataset.folder, identity) == dataset
    assert manifest.read_bytes() == content


def test_a_manifest_of_a_later_version_is_refused(dataset):
    path = dataset.folder / MANIFEST
    path.write_text(json.dumps(json.loads(path.read_text()) | {"compression": "int16"}))
    with pytest.raises(ValueError, match="compression"):
        open_dataset(dataset.folder)


def test_the_fingerprint_changes_with_the_bytes_and_only_with_them(dataset, fill):
    before = dataset.fingerprint()
    assert open_dataset(dataset.folder).fingerprint() == before
    fill(dataset, 24)
    assert dataset.fingerprint() != before


def test_shards_without_episodes_are_refused(identity):
    with pytest.raises(ValueError, match="episodes_per_shard must be at least 1, got 0"):
        replace(identity, episodes_per_shard=0)
