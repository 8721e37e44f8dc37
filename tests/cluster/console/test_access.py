"""Who may enter: named tokens, of which only hashes are kept."""

import json
import stat

import pytest

from cluster.console.access import FILE, AccessTokens, Person, Role
from cluster.console.tokens import change
from cluster.errors import UsageError, UserError


def named(person: Person):
    return person.name, person.role


def test_a_token_opens_for_its_person_and_is_kept_nowhere(tmp_path):
    tokens = AccessTokens(tmp_path)
    ada, vera = tokens.issue("Ada", Role.OPERATOR), tokens.issue("Vera", Role.VIEWER)
    assert named(tokens.person(ada)) == ("Ada", Role.OPERATOR)
    assert named(tokens.person(vera)) == ("Vera", Role.VIEWER)
    assert tokens.person("") is None
    text = (tmp_path / FILE).read_text()
    assert ada not in text
    assert vera not in text
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600


def test_a_token_ends_when_it_is_revoked_or_given_anew(tmp_path):
    tokens = AccessTokens(tmp_path)
    first = tokens.issue("Ada", Role.OPERATOR)
    entered = tokens.person(first)
    assert tokens.knows(entered)
    second = tokens.issue("Ada", Role.OPERATOR)
    assert tokens.person(first) is None
    assert not tokens.knows(entered)
    tokens.revoke("Ada")
    assert tokens.person(second) is None
    with pytest.raises(UsageError, match="nobody called 'Ada' has a token; there are: none"):
        tokens.revoke("Ada")


@pytest.mark.parametrize("name", ["", "  ", "a\nb", "x" * 81])
def test_a_name_is_one_of_a_person(tmp_path, name):
    with pytest.raises(UsageError, match="needs the name of a person"):
        AccessTokens(tmp_path).issue(name, Role.VIEWER)


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{", '{"Ada": {}}', '{"Ada": {"role": "king", "sha256": "", "since": ""}}', '{"\xff": 1}'],
)
def test_a_damaged_file_lets_nobody_in_and_says_so(tmp_path, content):
    (tmp_path / FILE).write_bytes(content.encode("latin-1"))
    with pytest.raises(UserError, match=r"tokens\.json cannot be used .* give tokens anew"):
        AccessTokens(tmp_path).person("anything")


def test_the_command_gives_lists_and_ends(tmp_path):
    [told, listed] = change("any", tmp_path, "Ada", "operator", None)
    assert named(AccessTokens(tmp_path).person(told.rpartition(" ")[2])) == ("Ada", Role.OPERATOR)
    assert listed.startswith("Ada: operator, since ")
    assert list(change("any", tmp_path, None, "viewer", "Ada")) == [
        "the token of Ada has ended",
        "nobody may enter the console of any yet",
    ]
    with pytest.raises(UsageError, match="--role must be one of viewer, operator, got 'king'"):
        list(change("any", tmp_path, "Ada", "king", None))
    assert json.loads((tmp_path / FILE).read_text()) == {}
