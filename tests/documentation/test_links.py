"""Links of the documentation lead to files and headings that exist, and terms to the glossary."""

import re

import pytest

from tests.documentation.pages import DOCS, PAGES, ROOT, anchors, links, name, slug

EVERY = [*PAGES, ROOT / "CHANGELOG.md"]
GLOSSARY = DOCS / "reference" / "glossary.md"
TERMS = (
    *("badness", "campaign", "controller", "gap", "latent path"),
    *("pool", "rehearsal", "shard", "slot", "stand-in"),
)
"""A user page that uses one of these links it to the glossary."""
USER_PAGES = [page for page in PAGES if page.parent.name in ("tutorial", "how-to")]


@pytest.mark.parametrize("page", EVERY, ids=name)
def test_links_lead_somewhere(page):
    broken = []
    for target in links(page):
        path, _, anchor = target.partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        file = (page.parent / path).resolve() if path else page
        if not file.exists() or (anchor and anchor not in anchors(file)):
            broken.append(target)
    assert broken == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.is_relative_to(DOCS)], ids=name)
def test_pages_of_the_site_link_nothing_outside_it(page):
    paths = [target.partition("#")[0] for target in links(page) if not re.match(r"[a-z]+:", target)]
    assert [path for path in paths if not (page.parent / path).resolve().is_relative_to(DOCS)] == []


@pytest.mark.parametrize("page", USER_PAGES, ids=name)
def test_terms_are_linked_to_the_glossary(page):
    text = re.sub(r"```.*?```|`[^`]*`|<!--.*?-->", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    linked = {target.partition("#")[2] for target in links(page) if "glossary.md#" in target}
    used = [term for term in TERMS if re.search(rf"\b{term}s?\b", text, re.IGNORECASE)]
    assert [term for term in used if slug(term) not in linked] == []


def test_the_glossary_has_every_term():
    assert {slug(term) for term in TERMS} <= anchors(GLOSSARY)
