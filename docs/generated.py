"""What the site derives from the code when it is built: the commands and the settings.

A page holds a comment such as `<!-- generated: commands -->`, and this hook of MkDocs puts the text there.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import griffe
import typer
import yaml
from typer.cli import get_docs_for_click

from cluster import config
from cluster.cli.main import app

_PLACE = re.compile(r"<!-- generated: (\w+) -->")
_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_TYPES = {"integer": "whole number", "number": "number", "string": "text"}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The text of a page with what is derived in its places."""
    return _PLACE.sub(lambda place: DERIVED[place.group(1)](), markdown)


def commands() -> str:
    """Every command with its arguments and options, from the command line itself."""
    group: Any = typer.main.get_command(app)
    context = typer.Context(group, info_name="svaedc")
    return get_docs_for_click(obj=group, ctx=context, indent=1, name="svaedc")


def settings() -> str:
    """Every setting with its type, default and docstring, section by section."""
    source = griffe.load("cluster.config")
    return "\n\n".join(_section(name, source) for name in config.Settings.model_fields)


def _section(name: str, source: Any) -> str:
    model: Any = config.Settings.model_fields[name].annotation
    described = source[model.__name__]
    schema = model.model_json_schema()["properties"]
    rows = [
        f"| `{name}.{key}` | {_kind(schema[key])} | {_default(_value(model, key))} "
        f"| {_one_line(described[key].docstring.value)} |"
        for key in model.model_fields
    ]
    head = ["| setting | type | default | meaning |", "|---|---|---|---|"]
    return "\n".join([f"## {name}", "", described.docstring.value, "", *head, *rows])


def _value(model: Any, key: str) -> Any:
    """The default as JSON has it; one that is found out at run time is what it is here."""
    return model().model_dump(mode="json")[key]


def _kind(schema: Mapping[str, Any]) -> str:
    return " or ".join(_kinds(schema))


def _kinds(schema: Mapping[str, Any]) -> Iterator[str]:
    if "anyOf" in schema:
        for each in schema["anyOf"]:
            yield from _kinds(each)
    elif "enum" in schema or "const" in schema:
        yield ", ".join(f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
    elif schema.get("format") == "path":
        yield "path"
    else:
        limits = " and ".join(f"{sign} {schema[key]:,}" for key, sign in _LIMITS.items() if key in schema)
        yield f"{_TYPES[schema['type']]} {limits}".rstrip()


def _default(value: Any) -> str:
    """As YAML writes it; a folder of whoever builds the site is everybody's `~`."""
    text = yaml.safe_dump(value).partition("\n")[0]
    return f"`{text.replace(str(Path.home()), '~')}`"


def _one_line(text: str) -> str:
    return " ".join(text.split())


DERIVED = {"commands": commands, "settings": settings}
"""What may stand in a page's place, by name."""
