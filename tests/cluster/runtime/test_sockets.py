"""Sockets whose paths Linux would find too long."""

import socket
import tempfile
from multiprocessing import connection
from pathlib import Path

import pytest

from cluster.config import RaySettings
from cluster.errors import UserError
from cluster.runtime.session import connect
from cluster.runtime.sockets import LONGEST, require_short_paths

DASHBOARD = ("dashboard",)


@pytest.fixture
def temporary_files(tmp_path, monkeypatch):
    """Lets the folder of temporary files have a path of so many bytes."""

    def move(length: int) -> Path:
        folder = tmp_path / ("x" * (length - len(str(tmp_path)) - 1))
        folder.mkdir()
        monkeypatch.setenv("TMPDIR", str(folder))
        monkeypatch.setattr(tempfile, "tempdir", None)
        return folder

    return move


def test_temporary_files_too_deep_for_the_dashboard_are_refused_before_ray_starts(temporary_files):
    folder = temporary_files(120)
    with pytest.raises(UserError, match=rf"below {folder}, .* 120 bytes.*; set TMPDIR to one of at most 75"):
        connect(RaySettings(), None, DASHBOARD).__enter__()


def test_the_limit_is_where_pythons_own_socket_meets_that_of_linux(temporary_files):
    """Ray's dashboard starts its parts through a socket of `multiprocessing`."""
    folder = temporary_files(75)
    require_short_paths(RaySettings(), DASHBOARD)
    path = f"{folder}/pymp-12345678/{Path(connection.arbitrary_address('AF_UNIX')).name}"
    assert len(path) == LONGEST


def test_without_the_dashboard_nothing_puts_sockets_among_temporary_files(temporary_files):
    temporary_files(120)
    require_short_paths(RaySettings(), ())
    with pytest.raises(UserError, match="set TMPDIR"):
        require_short_paths(RaySettings(), DASHBOARD)


def test_linux_takes_a_path_of_the_length_that_is_allowed_and_none_beyond(tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    for length, fits in ((LONGEST, True), (LONGEST + 1, False)):
        with socket.socket(socket.AF_UNIX) as probe:
            name = str(tmp_path / "x")[:90].ljust(length, "x")
            if fits:
                with pytest.raises(FileNotFoundError):
                    probe.connect(name)
            else:
                with pytest.raises(OSError, match="too long"):
                    probe.connect(name)


@pytest.mark.parametrize("parts", [(), DASHBOARD])
def test_rays_own_folder_is_refused_where_its_sockets_do_not_fit(parts):
    folder = Path("/tmp") / ("ü" * 30)
    with pytest.raises(UserError, match=r"65 bytes, .*at most \d\d with --set ray\.temporary_folder=DIR"):
        require_short_paths(RaySettings(temporary_folder=folder), parts)
    require_short_paths(RaySettings(), parts)
