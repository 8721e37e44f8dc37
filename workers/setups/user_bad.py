"""A setup with G_bad of a user's own, named as `module:function`."""

import difflib
import inspect
from dataclasses import replace
from typing import Any

from workers.setups.registry import file_digest, import_user_module
from workers.setups.setup import Setup
from workers.tasks.own_bad import OwnBad, marked_conditions


def with_bad(setup: Setup, name: str) -> Setup:
    """Replace a setup's G_bad by a user's own.

    Args:
        setup: whose G_bad it is.
        name: of the function, as `module:function`; "" for none.

    Returns:
        The setup with that G_bad; as it was for the name "".

    Raises:
        LookupError: there is no such module, or no such function in it.
    """
    if not name:
        return setup
    function = _function(name)
    marked = marked_conditions(function)
    return replace(
        setup,
        task=OwnBad(
            task=setup.task,
            function=function,
            bad_name=name,
            bad_digest=file_digest(function),
            conditions=marked or (function.__name__,),
            graded=not marked,
        ),
    )


def _function(name: str) -> Any:
    module_name, _, function_name = name.partition(":")
    if not module_name or not function_name:
        raise LookupError(f"G_bad must be named as module:function, got {name!r}")
    module = import_user_module(module_name)
    function = getattr(module, function_name, None)
    if not inspect.isfunction(function):
        there = [key for key, value in vars(module).items() if inspect.isfunction(value)]
        nearest = difflib.get_close_matches(function_name, there, n=1, cutoff=0.0)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        raise LookupError(f"module {module_name!r} has no function {function_name!r}{hint}")
    return function
