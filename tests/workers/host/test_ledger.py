"""What a robot did is never forgotten in silence, whatever happens to the file."""

import random
from itertools import pairwise

import pytest

from workers.host.ledger import CUT, Ledger, LedgerDamaged
from workers.host.ledger import _parsed_entry as parse


@pytest.fixture
def ledger(tmp_path):
    made = Ledger(tmp_path / "ledger.jsonl")
    for number in range(6):
        made.append("started", {"trial": f"desk-{number}", "x": "a" * 64})
        made.append("ended", {"trial": f"desk-{number}", "measurement": {"f": 0.1 * number, "y": 0.25}})
    return made


def test_lines_are_chained_and_read_back(ledger):
    entries = ledger.entries()
    assert [entry.seq for entry in entries] == list(range(1, 13))
    assert all(one.hash == other.prev for one, other in pairwise(entries))
    assert entries[3].facts["measurement"] == {"f": 0.1, "y": 0.25}
    assert not ledger.is_cut
    assert Ledger(ledger.path.with_name("none.jsonl")).entries() == []


def test_a_line_that_was_cut_off_is_told_and_the_next_goes_on_behind_it(ledger):
    content = ledger.path.read_bytes()
    last = content.rfind(b"\n", 0, -1) + 1
    for kept in (last + 1, (last + len(content)) // 2, len(content) - 1):
        ledger.path.write_bytes(content[:kept])
        assert ledger.is_cut
        assert len(ledger.entries()) == 11
        ledger.append("started", {"trial": "desk-9"})
        assert not ledger.is_cut
        assert [entry.event for entry in ledger.entries()][-2:] == [CUT, "started"]
        assert bytes.fromhex(ledger.entries()[-2].facts["rest"]) == content[last:kept]


def test_a_line_that_is_gone_doubled_or_swapped_is_damage(ledger):
    whole = ledger.path.read_bytes().splitlines(keepends=True)
    for other in (whole[1:], whole[:3] + whole[4:], whole[:3] + whole[2:], [whole[1], whole[0], *whole[2:]]):
        ledger.path.write_bytes(b"".join(other))
        for ask in (ledger.entries, lambda: ledger.append("started", {})):
            with pytest.raises(LedgerDamaged, match=r"is damaged: line \d+ .* Nothing moves\. Keep the file"):
                ask()


@pytest.mark.parametrize("times", [400, pytest.param(10_000, marks=pytest.mark.slow)])
def test_flipped_bits_and_strange_bytes_never_forget_a_start(ledger, times):
    rng, whole = random.Random(times), ledger.path.read_bytes()
    known = [entry.hash for entry in ledger.entries()]
    for _ in range(times):
        content = bytearray(whole)
        for _ in range(rng.randint(1, 3)):
            content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.2:
            content[rng.randrange(len(content)) :] = rng.randbytes(rng.randrange(40))
        ledger.path.write_bytes(content)
        try:
            found = [entry.hash for entry in ledger.entries()]
        except LedgerDamaged:
            continue
        # What is left is a beginning, and a reader is told where something stood behind it.
        assert known[: len(found)] == found
        assert ledger.is_cut or bytes(content) == whole or whole.startswith(bytes(content))


def test_what_cannot_be_written_leaves_the_ledger_as_it_was(ledger):
    before = ledger.path.read_bytes()
    with pytest.raises(ValueError, match="not JSON compliant"):
        ledger.append("ended", {"f": float("nan")})
    assert ledger.path.read_bytes() == before


def test_what_was_verified_before_is_verified_again_when_its_bytes_have_changed(tmp_path):
    ledger = Ledger(tmp_path / "ledger.jsonl")
    for number in range(3):
        ledger.append("started", {"trial": f"t-{number}"})
    content = ledger.path.read_bytes()
    assert len(ledger.entries()) == 3
    ledger.path.write_bytes(content.replace(b"t-1", b"t-7"))
    for ask in (ledger.entries, lambda: ledger.append("ended", {}), Ledger(ledger.path).entries):
        with pytest.raises(LedgerDamaged, match="line 2 was altered"):
            ask()
    ledger.path.write_bytes(content[: content.index(b"\n") + 1])
    assert [entry.facts["trial"] for entry in ledger.entries()] == ["t-0"]


def test_of_a_ledger_of_years_only_the_new_lines_are_read(tmp_path, monkeypatch):
    ledger = Ledger(tmp_path / "ledger.jsonl")
    for number in range(40):
        ledger.append("started", {"trial": f"t-{number}"})
    parsed = []
    monkeypatch.setattr("workers.host.ledger._parsed_entry", lambda line: parsed.append(line) or parse(line))
    ledger.append("ended", {"trial": "t-39"})
    ledger.append("started", {"trial": "t-40"})
    assert len(parsed) == 2
    assert len(ledger.entries()) == 42
