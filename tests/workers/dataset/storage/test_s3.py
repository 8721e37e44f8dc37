"""Paths in an object store as names, before anything is asked of the store."""

import pickle

import pytest

from workers.dataset.storage.s3 import ObjectPath, object_path


def test_names_and_parents_are_those_of_a_folder():
    path = object_path("s3://bucket/some/data") / "a.parquet"
    assert str(path) == "s3://bucket/some/data/a.parquet"
    assert (path.name, path.parent) == ("a.parquet", object_path("s3://bucket/some/data"))
    assert object_path("s3://bucket").parent == object_path("s3://bucket")
    assert str(object_path("s3://bucket") / "a") == "s3://bucket/a"


def test_an_address_with_an_endpoint_keeps_it_and_takes_over_the_region_alone():
    given = {"endpoint_override": "minio:9000", "region": "home", "scheme": "http"}
    assert object_path("s3://bucket/a").at(given).options == tuple(sorted(given.items()))
    own = object_path("s3://bucket/a?endpoint_override=elsewhere:1").at(given)
    assert dict(own.options) == {"endpoint_override": "elsewhere:1", "region": "home"}


def test_what_has_been_fetched_is_read_without_the_store():
    path = ObjectPath("bucket", "a", content=b"bytes")
    assert path.fetch() is path
    assert path.open().read() == b"bytes"
    assert path == ObjectPath("bucket", "a")


def test_an_object_is_not_opened_to_be_written():
    with pytest.raises(ValueError, match="written whole by write_bytes, got mode 'wb'"):
        ObjectPath("bucket", "a").open("wb")


def test_a_path_travels_to_another_process():
    path = object_path("s3://bucket/a?region=eu-west-1")
    assert pickle.loads(pickle.dumps(path)) == path
