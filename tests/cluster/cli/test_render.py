"""`svaedc render`: what it writes, and what it refuses first."""

import pytest
from PIL import Image

from tests.cluster.cli.command_line import svaedc

WIDTH, HEIGHT = 64, 48


@pytest.mark.slow
def test_the_command_writes_what_it_says(tmp_path):
    sizes = ("--width", str(WIDTH), "--height", str(HEIGHT), "--stills", "2")
    result = svaedc(
        "render", "--setup", "franka", "--x", "random:7", "--out", "new/strip.png", *sizes, folder=tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert "wrote" in result.stderr
    assert "2 pictures" in result.stderr
    with Image.open(tmp_path / "new" / "strip.png") as image:
        assert image.size == (2 * WIDTH, HEIGHT)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["strip.png"]


@pytest.mark.parametrize(
    ("name", "width", "message"),
    [
        ("clip.avi", 64, r"--out must end in \.gif, \.mp4 or \.png, got clip\.avi"),
        ("clip", 64, r"--out must end in \.gif, \.mp4 or \.png, got clip"),
        ("clip.gif", 4, "width must be 16 to 4096 pixels, got 4; change --width"),
        ("clip.mp4", 65, "an .mp4 needs an even width and height, got 65 × 48"),
    ],
)
def test_a_wish_that_cannot_be_met_is_refused_before_anything_is_written(tmp_path, name, width, message):
    from cluster.cli.render import render
    from cluster.errors import UsageError

    if name.endswith("mp4"):
        pytest.importorskip("av")
    with pytest.raises(UsageError, match=message):
        render("franka", "random:7", tmp_path / "new" / name, width=width, height=HEIGHT)
    assert not list(tmp_path.iterdir())
