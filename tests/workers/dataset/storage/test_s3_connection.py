"""What an object store refuses or lacks is told apart, with the remedy."""

import urllib.request
from dataclasses import replace

import pytest

from tests.workers.dataset.storage.contents import FIRST
from workers.dataset import schema
from workers.dataset.folder import Dataset, create, open_dataset
from workers.dataset.storage.location import location
from workers.dataset.storage.s3_connection import StoreError, reaching


@pytest.mark.parametrize("answer", ["NO_SUCH_KEY during GetObject", "RESOURCE_NOT_FOUND during GetObject"])
def test_an_object_that_goes_while_it_is_read_is_missing_and_no_fault_of_the_store(answer):
    with pytest.raises(FileNotFoundError), reaching("s3://bucket/key"):
        raise OSError(f"When reading information for key 'key': AWS Error {answer} operation: ")
    with pytest.raises(StoreError, match="check its region"), reaching("s3://bucket"):
        raise OSError("AWS Error RESOURCE_NOT_FOUND during ListObjectsV2 operation: ")


def test_a_bucket_that_is_missing_is_named(object_store, identity):
    nowhere = location(f"s3://nobody-s?endpoint_override={object_store}&region=us-east-1&scheme=http")
    for attempt in (lambda: open_dataset(nowhere), lambda: create(nowhere / "data", identity)):
        with pytest.raises(StoreError, match=r"no bucket for s3://nobody-s.*: create it"):
            attempt()


def test_a_store_that_is_away_is_no_damage_of_the_dataset(remote, free_port):
    nobody = (("endpoint_override", f"127.0.0.1:{free_port}"), ("region", "us-east-1"), ("scheme", "http"))
    gone = Dataset(replace(remote.folder, options=nobody), remote.identity)
    with pytest.raises(StoreError, match=r"does not answer .*: check the network, and AWS_ENDPOINT_URL"):
        schema.read_outcomes(gone.path(FIRST), gone.identity)


def test_refused_credentials_are_named_with_the_remedy(remote, object_store):
    demand(object_store, "0")
    try:
        with pytest.raises(StoreError, match=r"refuses access to s3://.*: set AWS_ACCESS_KEY_ID"):
            remote.shards()
        with pytest.raises(StoreError, match="refuses access"):
            remote.path(FIRST).write_bytes(b"mine")
    finally:
        demand(object_store, "inf")
    assert len(remote.shards()) == 3


def demand(object_store: str, after: str) -> None:
    """Lets the server ask for known credentials after that many requests."""
    request = urllib.request.Request(
        f"http://{object_store}/moto-api/reset-auth",
        data=after.encode(),
        headers={"Content-Type": "application/octet-stream"},
        method="POST",
    )
    urllib.request.urlopen(request, timeout=60).close()
