"""A path in an object store: what `pathlib.Path` is on a disk, as far as a dataset needs it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from workers.dataset.storage.s3_connection import (
    OPTIONS,
    Options,
    connection,
    is_found,
    reaching,
    require_bucket,
)
from workers.dataset.storage.temporary import WRITING, writer

ONE_REQUEST = 10 << 20
"""PyArrow sends so many bytes at once."""


@dataclass(frozen=True)
class Stat:
    """What is known of an object.

    Attributes:
        st_size: its bytes.
    """

    st_size: int


@dataclass(frozen=True)
class ObjectPath:
    """An object, or the common beginning of the names of several, with the methods of `pathlib.Path`.

    Nothing is asked of the store before a method needs it, so a path travels to other processes.

    Attributes:
        bucket: its name.
        key: without slashes at either end; "" for the whole bucket.
        options: of the connection, by the names in `OPTIONS`; what is not given is the environment's.
        known: what a listing said of the object already.
        content: its bytes, when they have been fetched already.
    """

    bucket: str
    key: str
    options: Options = ()
    known: Stat | None = field(default=None, compare=False, repr=False)
    content: bytes | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return f"s3://{self._place}" + (f"?{urlencode(self.options, safe=':/')}" if self.options else "")

    def __truediv__(self, name: str) -> "ObjectPath":
        return ObjectPath(self.bucket, f"{self.key}/{name}".lstrip("/"), self.options)

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition("/")[2]

    @property
    def parent(self) -> "ObjectPath":
        """What all names before the last slash of the key have in common."""
        return ObjectPath(self.bucket, self.key.rpartition("/")[0], self.options)

    def at(self, options: Mapping[str, str]) -> "ObjectPath":
        """The same path at a store for which these options hold unless the address has its own endpoint.

        A region is taken over even then, for an endpoint does not tell it.
        """
        own = dict(self.options)
        kept = options if "endpoint_override" not in own else {"region": options.get("region", "")}
        merged = {name: value for name, value in {**kept, **own}.items() if value}
        return replace(self, options=tuple(sorted(merged.items())))

    def resolve(self) -> "ObjectPath":
        """The path itself: an address is the same everywhere."""
        return self

    def is_absolute(self) -> bool:
        """True: an address is the same everywhere."""
        return True

    def as_uri(self) -> str:
        """The address."""
        return str(self)

    def mkdir(self, *, parents: bool = False, exist_ok: bool = False) -> None:
        """Do nothing, for a store has no folders.

        Args:
            parents: as of `pathlib.Path`.
            exist_ok: as of `pathlib.Path`.
        """

    def exists(self) -> bool:
        """Whether there is such an object, or one below; a bucket that is missing is refused."""
        with reaching(self):
            is_there = is_found(self._store.get_file_info(self._place))
        if not is_there:
            require_bucket(self.bucket, self.options)
        return is_there

    def stat(self) -> Stat:
        """Its size, without a request if a listing said it already."""
        if self.known is not None:
            return self.known
        with reaching(self), self._store.open_input_file(self._place) as file:
            return Stat(file.size())

    def iterdir(self) -> Iterator["ObjectPath"]:
        """The objects directly below, none if there are none."""
        from pyarrow import fs

        with reaching(self):
            listed = self._store.get_file_info(fs.FileSelector(self._place, allow_not_found=True))
        for info in listed:
            if info.type == fs.FileType.File:
                yield replace(self / info.base_name, known=Stat(info.size))

    def glob(self, pattern: str) -> Iterator["ObjectPath"]:
        """Those of them whose name fits a pattern without slashes."""
        return (path for path in self.iterdir() if fnmatch(path.name, pattern))

    def open(self, mode: str = "rb") -> Any:
        """A file of PyArrow's to read from; errors of reading are for `refusal` to explain."""
        import pyarrow

        if mode != "rb":
            raise ValueError(f"an object is read as 'rb' and written whole by write_bytes, got mode {mode!r}")
        if self.content is not None:
            return pyarrow.BufferReader(self.content)
        with reaching(self):
            return self._store.open_input_file(self._place)

    def fetch(self) -> "ObjectPath":
        """The same path with its bytes, which are asked for once."""
        return self if self.content is not None else replace(self, content=self.read_bytes())

    def read_bytes(self) -> bytes:
        """All its bytes; a missing object raises `FileNotFoundError`."""
        with reaching(self), self._store.open_input_stream(self._place) as stream:
            return bytes(stream.read())

    def read_text(self, encoding: str = "utf-8", errors: str = "strict") -> str:
        """Its bytes as text.

        Args:
            encoding: as of `pathlib.Path`.
            errors: as of `pathlib.Path`.

        Returns:
            All of them.
        """
        return self.read_bytes().decode(encoding, errors)

    def write_bytes(self, content: bytes) -> None:
        """Put the object there at once, in the place of what was there.

        What does not fit in one request goes in parts, which PyArrow joins even if some of them were refused:
        so it goes to a name of its writer's first, and one request copies it from there.
        """
        if len(content) <= ONE_REQUEST:
            self._upload(content)
            return
        aside = self.parent / WRITING / f"{self.name}.{writer()}"
        try:
            aside._upload(content)
            with reaching(self):
                self._store.copy_file(aside._place, self._place)
        finally:
            aside.unlink(missing_ok=True)

    def _upload(self, content: bytes) -> None:
        with reaching(self):
            stream = self._store.open_output_stream(self._place)
            try:
                stream.write(content)
                stream.close()
            finally:
                del stream  # one that failed ends here by joining its parts, before whoever called goes on

    def write_text(self, text: str, encoding: str = "utf-8") -> None:
        """The same for text.

        Args:
            text: that the object is to hold.
            encoding: as of `pathlib.Path`.
        """
        self.write_bytes(text.encode(encoding))

    def unlink(self, *, missing_ok: bool = False) -> None:
        """Remove the object."""
        try:
            with reaching(self):
                self._store.delete_file(self._place)
        except FileNotFoundError:
            if not missing_ok:
                raise

    @property
    def _place(self) -> str:
        return f"{self.bucket}/{self.key}".rstrip("/")

    @property
    def _store(self) -> Any:
        return connection(self.options)


def object_path(address: str) -> ObjectPath:
    """The path that an address such as `s3://bucket/prefix?region=eu-west-1` names.

    Raises:
        ValueError: it is no such address, or holds what does not belong there.
    """
    parts = urlsplit(address)
    form = f"an object store is addressed as s3://bucket/prefix, got {address!r}"
    if parts.scheme != "s3" or not parts.netloc or parts.fragment:
        raise ValueError(form)
    if "@" in parts.netloc:
        raise ValueError("an address holds no credentials; AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY do")
    key = parts.path.strip("/")
    if key and not {"", ".", ".."}.isdisjoint(key.split("/")):
        raise ValueError(f"{form}, whose prefix has empty or dotted parts")
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    unknown = sorted(options.keys() - {*OPTIONS})
    if unknown or not all(options.values()):
        raise ValueError(f"{form}; after the ? may stand {', '.join(OPTIONS)}, each with a value")
    if options.get("scheme", "https") not in ("http", "https"):
        raise ValueError(f"scheme must be http or https, got {options['scheme']!r}")
    return ObjectPath(parts.netloc, key, tuple(sorted(options.items())))
