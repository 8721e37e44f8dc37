"""Addresses of datasets as a user gives them."""

from pathlib import Path

import pytest

from cluster.errors import UsageError
from cluster.inputs import dataset_location, durable_dataset


def test_an_address_takes_the_store_of_the_environment_along(monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9000")
    monkeypatch.setenv("AWS_REGION", "eu-west-1")
    assert str(durable_dataset("s3://bucket/data")) == (
        "s3://bucket/data?endpoint_override=127.0.0.1:9000&region=eu-west-1&scheme=http"
    )
    assert str(dataset_location("s3://bucket/data?endpoint_override=minio:1&region=home")) == (
        "s3://bucket/data?endpoint_override=minio:1&region=home"
    )
    assert dataset_location("data/franka") == Path("data/franka")
    assert durable_dataset("data") == Path.cwd() / "data"


def test_an_address_of_another_kind_of_store_is_a_usage_error():
    with pytest.raises(UsageError, match=r"addressed as s3://bucket/prefix, got 'gs://bucket/data'"):
        dataset_location("gs://bucket/data")
