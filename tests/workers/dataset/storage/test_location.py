"""Addresses of folders on disks and in object stores."""

import pytest

from workers.dataset.storage.location import location


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ("s3:///data", "s3://bucket/prefix"),
        ("gs://bucket/data", "s3://bucket/prefix"),
        ("s3://key:secret@bucket/data", "holds no credentials"),
        ("s3://bucket/a/../b", "dotted parts"),
        ("s3://bucket/a?endpoint=127.0.0.1:9000", "endpoint_override, region, scheme"),
        ("s3://bucket/a?scheme=ftp", "http or https, got 'ftp'"),
    ],
)
def test_an_address_that_is_none_is_refused_with_what_was_expected(wrong, why):
    with pytest.raises(ValueError, match=why.replace("?", r"\?")):
        location(wrong)


@pytest.mark.parametrize(
    "text", ["s3://bucket", "s3://bucket/a/b", "s3://bucket/a?endpoint_override=127.0.0.1:9000&scheme=http"]
)
def test_an_address_is_written_as_it_was_read(text):
    assert str(location(text)) == text
    assert location(text) == location(f"{text}")
    assert (location("s3://bucket/") / "name").name == "name"
