"""Values as JSON has them: it lacks a word for a number that is not finite."""

import math
from typing import Any


def json_values(content: Any) -> Any:
    """The same dictionaries, lists and values, with None for every number that is not finite."""
    if isinstance(content, dict):
        return {name: json_values(value) for name, value in content.items()}
    if isinstance(content, list | tuple):
        return [json_values(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
