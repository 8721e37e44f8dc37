"""The pages of the documentation: their fences, what is run of them, and their links."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
RUN = ("console", "python")
"""Fences in these languages are run, unless they are marked."""

_MARKDOWN = MarkdownIt("commonmark").enable("table")
_NOT_RUN = re.compile(r"<!-- not run: (.+?) -->", re.DOTALL)
_PAGE_NOT_RUN = re.compile(r"<!-- page not run: (.+?) -->", re.DOTALL)
_HIDDEN = re.compile(r"<!-- run: (.+?) -->", re.DOTALL)
_TITLE = re.compile(r'title="([^"]+)"')
_PROMPT = "$ "


@dataclass(frozen=True)
class Fence:
    """A fenced block, or a hidden one in a comment.

    Attributes:
        language: the first word behind the fence.
        title: the file that a reader copies it into; "" for none.
        text: what it holds.
        line: of the page, from 1.
        reason: why it is not run; "" when it is.
        hidden: whether readers do not see it.
    """

    language: str
    title: str
    text: str
    line: int
    reason: str
    hidden: bool = False

    @property
    def is_run(self) -> bool:
        return not self.reason and (self.language in RUN or bool(self.title))


@dataclass(frozen=True)
class Step:
    """One thing to do: a line for the shell, and what it prints; "…" stands for anything."""

    line: int
    command: str
    expected: str


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def fences(page: Path) -> list[Fence]:
    """The fences of a page in order, each with the reason in the comment before it."""
    tokens = _MARKDOWN.parse(page.read_text(encoding="utf-8"))
    comments = "\n".join(token.content for token in tokens if token.type == "html_block")
    whole = _PAGE_NOT_RUN.search(comments)
    found, reason = [], ""
    for token in tokens:
        if token.type == "fence":
            found.append(_fence(token, whole.group(1) if whole else reason))
            reason = ""
        elif token.type == "html_block":
            marked = _NOT_RUN.search(token.content)
            reason = marked.group(1) if marked else ""
            found += [
                Fence("console", "", f"{_PROMPT}{hidden.group(1)}", _line(token), "", hidden=True)
                for hidden in _HIDDEN.finditer(token.content)
            ]
        elif token.map and token.level == 0 and token.type.endswith("_open"):
            reason = ""
    return found


def steps(page: Path) -> Iterator[Step]:
    """What is done of a page, in its order."""
    for fence in fences(page):
        if not fence.is_run:
            continue
        if fence.title:
            yield Step(fence.line, _written(fence.title, fence.text), "")
        elif fence.language == "python":
            yield Step(fence.line, _heredoc("python -", fence.text), "…")
        else:
            yield from _commands(fence)


def _commands(fence: Fence) -> Iterator[Step]:
    """The commands of a console, each with the lines below it; a hidden one may print anything."""
    parts = re.split(rf"^{re.escape(_PROMPT)}", fence.text, flags=re.MULTILINE)[1:]
    for part in parts:
        command, _, printed = _split(part)
        yield Step(fence.line, command, "…" if fence.hidden else printed)


def _split(part: str) -> tuple[str, str, str]:
    """A command goes on in the next line behind a backslash."""
    found = re.match(r"((?:[^\n]*\\\n)*[^\n]*)(\n?)(.*)", part, re.DOTALL)
    assert found
    return found.group(1), found.group(2), found.group(3)


def _written(file: str, text: str) -> str:
    return f"mkdir -p \"$(dirname '{file}')\"\n" + _heredoc(f"cat > '{file}'", text)


def _heredoc(command: str, text: str) -> str:
    return f"{command} <<'END_OF_FENCE'\n{text}END_OF_FENCE"


def _fence(token: Token, reason: str) -> Fence:
    language, _, rest = token.info.strip().partition(" ")
    title = _TITLE.search(rest)
    return Fence(language, title.group(1) if title else "", token.content, _line(token), reason)


def _line(token: Token) -> int:
    return token.map[0] + 1 if token.map else 0


def links(page: Path) -> Iterator[str]:
    """Targets of the links and pictures of a page."""
    for token in _MARKDOWN.parse(page.read_text(encoding="utf-8")):
        for child in token.children or ():
            target = child.attrGet("href") or child.attrGet("src")
            if target:
                yield str(target)


def anchors(page: Path) -> set[str]:
    """What a link may name behind #: every heading, as GitHub and MkDocs both write it."""
    tokens = _MARKDOWN.parse(page.read_text(encoding="utf-8"))
    headings = [following.content for token, following in pairwise(tokens) if token.type == "heading_open"]
    return {slug(heading) for heading in headings}


def slug(heading: str) -> str:
    words = re.sub(r"[^\w\s-]", "", heading.strip().lower())
    return re.sub(r"\s+", "-", words)
