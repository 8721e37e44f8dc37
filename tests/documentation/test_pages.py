"""Every command of the documentation prints what the documentation says (`make test-docs`)."""

from pathlib import Path

import pytest

from tests.documentation.console import carry_out
from tests.documentation.pages import PAGES, name, steps

pytestmark = pytest.mark.documentation


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("home")


@pytest.mark.parametrize("page", [page for page in PAGES if any(steps(page))], ids=name)
def test_a_page_prints_what_it_says(page, tmp_path, home):
    wanted = list(steps(page))
    done = carry_out(wanted, tmp_path, home)
    complaints = [complaint for each in done if (complaint := each.complaint())]
    if len(done) < len(wanted):
        complaints.append(f"the shell ended in line {wanted[len(done)].line}")
    if complaints:
        pytest.fail("\n\n".join(complaints), pytrace=False)
