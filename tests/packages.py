"""Packages of others, as far as Python's own machinery knows them: a module, and what it offers by name."""

from collections.abc import Mapping
from pathlib import Path


def install(folder: Path, package: str, offers: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
    """Lay out an installed package in a folder that is on Python's path.

    Args:
        folder: on the path.
        package: its name; its version is 1.0.
        offers: its entry points, `module:name` by name, by group.
        **modules: its source files.

    Returns:
        The folder.
    """
    facts = folder / f"{package.replace('-', '_')}-1.0.dist-info"
    facts.mkdir(parents=True)
    (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    sections = (
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
        for group, entries in offers.items()
    )
    (facts / "entry_points.txt").write_text("\n".join(sections))
    for name, source in modules.items():
        (folder / f"{name}.py").write_text(source)
    return folder
