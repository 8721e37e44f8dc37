"""A dataset in an object store: the same as the one on a disk."""

import pytest


@pytest.fixture
def address(object_store, bucket) -> str:
    return f"s3://{bucket}/some/data?endpoint_override={object_store}&region=us-east-1&scheme=http"


@pytest.fixture
def place(address):
    """Where nothing is yet."""
    from workers.dataset.storage.location import location

    return location(address)


@pytest.fixture
def remote(place, identity, fill):
    """The same three shards as those of `dataset`, in the store."""
    from workers.dataset.folder import create

    created = create(place, identity)
    fill(created, 20)
    return created
