"""Files of a user's that hide libraries: Ray's processes look into the working directory first."""

import inspect
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from cluster.errors import UserError

NEEDED = frozenset(
    {"cluster", "svaedc", "workers"}
    | {"botorch", "gpytorch", "jaxtyping", "linear_operator", "numpy", "pyarrow", "pybullet", "pybullet_data"}
    | {"colorful", "fsspec", "matplotlib", "mpmath", "multipledispatch", "networkx", "PIL", "scipy", "sympy"}
    | {"threadpoolctl", "torch", "torchgen", "typing_inspect"}
)
"""Ray's processes load these, whatever this one has loaded; so they do much of the standard library."""
UNUSED = frozenset({"antigravity", "idlelib", "test", "this", "tkinter", "turtle", "turtledemo"})
"""Nobody loads these of the standard library, and `test.py` is a name that people like."""


def require_no_shadows(folder: Path) -> None:
    """Refuses a folder with a file that Ray's processes would take for a library.

    Nothing is imported: the file's name is enough.

    Args:
        folder: the working directory.

    Raises:
        UserError: there is such a file or package; the message names it and what it hides.
    """
    for path, hidden in _shadows(folder):
        raise UserError(
            f"{path} hides {hidden} from the processes that Ray starts, which look for modules in the "
            "working directory first: rename it, or start the command in another folder"
        )


def require_own_packages() -> None:
    """Ends a command that would load a user's `workers` or `svaedc` for the packages of these names.

    That is so where PYTHONPATH names the folder of such a file, and under `python -m`.
    """
    installed = Path(__file__).parents[2]
    for name in ("svaedc", "workers"):
        place = _place(name)
        if place and not Path(place).resolve().is_relative_to(installed.resolve()):
            sys.exit(
                f"error: {place} hides {installed / name}: rename it, or take its folder out of PYTHONPATH"
            )


def _shadows(folder: Path) -> Iterator[tuple[Path, str]]:
    """Files and packages in a folder, each with the library of its name that lies elsewhere."""
    for path in sorted(folder.iterdir()):
        name = _module_name(path)
        if name and _is_loaded_by_ray(name):
            hidden = _place(name)
            if hidden and not Path(hidden).resolve().is_relative_to(path.resolve()):
                yield path, hidden


def _module_name(path: Path) -> str:
    """What `import` finds there; "" for what hides nothing, as a folder without `__init__.py`."""
    if not path.is_dir():
        return inspect.getmodulename(path) or ""
    is_package = any(inspect.getmodulename(each) == "__init__" for each in path.glob("__init__.*"))
    return path.name if is_package else ""


def _is_loaded_by_ray(name: str) -> bool:
    if name in UNUSED or name.startswith("__"):
        return False
    return name in NEEDED or name in sys.modules or name in sys.stdlib_module_names


def _place(name: str) -> str:
    """Where this process finds a module; "" for one that is no file, or that Python has in itself."""
    try:
        spec = find_spec(name)
    except ValueError:  # a module that was made, not loaded
        return ""
    return spec.origin or "" if spec is not None and spec.has_location else ""
