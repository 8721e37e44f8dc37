"""Whose file it is, by its metadata alone."""

from dataclasses import replace
from pathlib import Path

import pytest

from workers.dataset.ownership import IDENTITY_DIGEST, IDENTITY_TEXT, identity_in, require_own

PATH = Path("data/episodes.parquet")


def metadata_of(identity, **changes: bytes) -> dict[bytes, bytes]:
    texts = {IDENTITY_TEXT: identity.to_json().encode(), IDENTITY_DIGEST: identity.digest.encode()} | changes
    return {name.encode(): value for name, value in texts.items()}


def test_the_identity_of_a_file_is_read_from_its_metadata(identity):
    assert identity_in(PATH, metadata_of(identity)) == identity


def test_a_file_of_somebody_elses_is_no_file_of_this_project():
    with pytest.raises(ValueError, match=rf"{PATH} holds no episodes of this project: .*{IDENTITY_TEXT}"):
        identity_in(PATH, {b"ARROW:schema": b"?"})


def test_a_file_of_another_dataset_is_refused_with_what_differs(identity):
    with pytest.raises(ValueError, match=r"differ in seed: 6 and 5\. `svaedc dataset verify"):
        require_own(PATH, metadata_of(replace(identity, seed=6)), identity)


def test_an_equal_identity_under_an_older_digest_is_the_datasets_own(identity):
    assert require_own(PATH, metadata_of(identity, **{IDENTITY_DIGEST: b"0" * 64}), identity) is None
