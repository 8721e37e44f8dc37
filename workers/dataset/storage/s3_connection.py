"""A connection to an object store, and what its refusals mean."""

import errno
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

CONNECT_SECONDS = 5.0
REQUEST_SECONDS = 20.0
ATTEMPTS = 3
"""A store that is away is given up after that many attempts, each of at most so long."""

OPTIONS = ("endpoint_override", "region", "scheme")
"""These names, which are PyArrow's, may stand behind the `?` of an address."""

Options = tuple[tuple[str, str], ...]

_GONE = re.compile(r"AWS Error (NO_SUCH_KEY|RESOURCE_NOT_FOUND during (Get|Head)Object)")
"""An answer without a body, as to an object that is removed while it is sent, does not name the key."""
_REFUSED = "ACCESS_DENIED|INVALID_ACCESS_KEY|SIGNATURE|TOKEN|AUTHENTICATION|CREDENTIAL|CLIENT|status 403"


class StoreError(OSError):
    """An object store that does not do what was asked; its text says why, and what to do."""

    def __str__(self) -> str:
        return str(self.strerror)


@contextmanager
def reaching(path: object) -> Iterator[None]:
    """Turns what PyArrow says of a store into a sentence with a remedy; other errors pass.

    Raises:
        StoreError: the store cannot be reached, or refuses.
        FileNotFoundError: an object was removed between two requests of one reading.
    """
    try:
        yield
    except OSError as error:
        if _GONE.search(str(error)):
            raise FileNotFoundError(errno.ENOENT, "no such object", str(path)) from error
        refused = refusal(path, error)
        if refused is None:
            raise
        raise refused from error


def refusal(path: object, error: Exception) -> StoreError | None:
    """Explain what an error says about the store.

    Args:
        path: that was asked for, for the text.
        error: as PyArrow raised it.

    Returns:
        The error to raise instead; None if it is about something else.
    """
    if isinstance(error, StoreError):
        return StoreError(error.errno, error.strerror)
    is_of_store = "AWS Error" in str(error) and not _GONE.search(str(error))
    return StoreError(*_explain(path, str(error))) if is_of_store else None


def _explain(path: object, reason: str) -> tuple[int, str]:
    """What is wrong, and its number: EACCES for what no further attempt changes."""
    brief = re.sub(r"\s*\(Request ID.*", "", reason.partition("AWS Error ")[2])
    if "NO_SUCH_BUCKET" in reason:
        return errno.EACCES, f"there is no bucket for {path}: create it, or name one that exists"
    if re.search(_REFUSED, reason):
        return errno.EACCES, (
            f"the object store refuses access to {path} ({brief}): set AWS_ACCESS_KEY_ID and "
            "AWS_SECRET_ACCESS_KEY, or AWS_PROFILE, to an account that may list, read, write and delete there"
        )
    if "NETWORK_CONNECTION" in reason:
        return errno.EHOSTUNREACH, (
            f"the object store of {path} does not answer ({brief}): check the network, and AWS_ENDPOINT_URL "
            "or ?endpoint_override=HOST:PORT&scheme=http if it is not Amazon's"
        )
    return errno.EREMOTEIO, (
        f"the object store of {path} failed ({brief}): check its region (AWS_REGION or ?region=NAME), and "
        "try again"
    )


def is_found(info: Any) -> bool:
    """Whether PyArrow's answer to a question for a path says that there is something."""
    from pyarrow import fs

    return info.type != fs.FileType.NotFound


@cache
def require_bucket(bucket: str, options: Options) -> None:
    """Make sure, once in a process, that a bucket exists.

    Args:
        bucket: its name.
        options: of the connection, by the names in `OPTIONS`.

    Raises:
        StoreError: it does not, or the store cannot be reached, or refuses.
    """
    name = f"s3://{bucket}"
    with reaching(name):
        is_there = is_found(connection(options).get_file_info(bucket))
    if not is_there:
        raise StoreError(*_explain(name, "NO_SUCH_BUCKET"))


@cache
def connection(options: Options) -> Any:
    """PyArrow's file system for a store, one in a process; PyArrow is loaded when the first is needed."""
    from pyarrow import fs

    return fs.S3FileSystem(
        **dict(options),
        connect_timeout=CONNECT_SECONDS,
        request_timeout=REQUEST_SECONDS,
        retry_strategy=fs.AwsStandardS3RetryStrategy(max_attempts=ATTEMPTS),
        allow_delayed_open=True,  # one request for a small object
        background_writes=False,
    )
