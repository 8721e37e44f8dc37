"""Reading the settings: `metadata.svaedc` of a Ray cluster file, then `--set` over it."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

import yaml
from pydantic import ValidationError

from cluster.config import Settings
from cluster.errors import UsageError, nearest

DEFAULT_FILE = Path("ray_config.yaml")
"""It is read from the working directory when no `--config` is given and it exists."""


def load_settings(path: Path | None, overrides: Sequence[str]) -> Settings:
    """Reads the settings of one command.

    Args:
        path: the file given with `--config`, which must exist; without one, `ray_config.yaml` of the working
            directory is read if it is there.
        overrides: `section.key=value` texts of `--set`, the later over the earlier and all over the file; the
            value is plain text, in which nothing has a meaning of its own.

    Returns:
        All sections, with the defaults of what is not given.

    Raises:
        UsageError: the file is absent or unreadable, a key is unknown or stands twice, or a value is out of
            its range.
    """
    sections = _sections(path if path is not None else DEFAULT_FILE) if path or DEFAULT_FILE.exists() else {}
    for override in overrides:
        _apply(override, sections)
    try:
        return Settings.model_validate(sections)
    except ValidationError as error:
        origin = f"{path or DEFAULT_FILE} or --set" if overrides else f"{path or DEFAULT_FILE}"
        raise UsageError(f"{origin}: " + "; ".join(_complaints(error))) from error


class _RepeatedKeyError(yaml.YAMLError):
    """A key stands twice in one mapping; the text says where."""


class _Loader(yaml.SafeLoader):
    """Refuses a key that stands twice in one mapping, as YAML does; PyYAML alone takes the last one."""

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        """The mapping, if all its keys are different."""
        node = super().compose_mapping_node(anchor)
        first: dict[tuple[str, str], int] = {}
        for key, _ in node.value:
            line = key.start_mark.line + 1
            if isinstance(key, yaml.ScalarNode) and first.setdefault((key.tag, key.value), line) != line:
                earlier = first[key.tag, key.value]
                raise _RepeatedKeyError(
                    f"line {line}: {key.value!r} stands in line {earlier} already; leave one out"
                )
        return node


def _sections(path: Path) -> dict[str, Any]:
    """The content of `metadata.svaedc`; a section in which everything is commented out reads as empty."""
    try:
        document = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except OSError as error:
        raise UsageError(
            f"cannot read the settings file {path}: {error.strerror}; give an existing file to --config"
        ) from error
    except _RepeatedKeyError as error:
        raise UsageError(f"{path}, {error}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is not YAML: {error}") from error
    metadata = _mapping(document, path, "the file").get("metadata")
    own = _mapping(_mapping(metadata, path, "metadata").get("svaedc"), path, "metadata.svaedc")
    return {name: dict(_mapping(keys, path, f"metadata.svaedc.{name}")) for name, keys in own.items()}


def _mapping(value: object, path: Path, place: str) -> Mapping[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise UsageError(f"{path}: {place} must be a mapping of names to values, got {value!r}")
    return value


def _apply(override: str, sections: dict[str, Any]) -> None:
    """Writes one `section.key=value` into the sections."""
    name, equals, text = override.partition("=")
    section, dot, key = name.strip().partition(".")
    if not (equals and dot and section and key):
        raise UsageError(f"--set takes section.key=value, such as train.workers=2, got {override!r}")
    sections.setdefault(section, {})[key] = text.strip()


def _complaints(error: ValidationError) -> Iterator[str]:
    """One sentence per bad key, naming it; a choice such as `number or all` is reported once."""
    seen = set()
    for detail in error.errors(include_url=False):
        place = tuple(str(part) for part in detail["loc"][:2])
        name = ".".join(place)
        if name in seen:
            continue
        seen.add(name)
        if detail["type"] == "extra_forbidden":
            yield f"unknown setting {name!r}, {nearest(name, _known_names(place))}"
        else:
            yield f"{name}: {detail['msg'][0].lower()}{detail['msg'][1:]}, got {detail['input']!r}"


def _known_names(place: Sequence[str]) -> list[str]:
    """The full names that could have stood where this unknown one stands."""
    sections = get_type_hints(Settings)
    names = [
        f"{section}.{key}" for section in Settings.model_fields for key in sections[section].model_fields
    ]
    return names if len(place) > 1 else list(Settings.model_fields)
