"""What the console's addresses do, to whom, and how often."""

import json
import re
import socket
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
import requests

from cluster.console import decisions, entrance, guards, looks
from cluster.hardware.record.attachments import attachments
from tests.cluster.console.served import awaiting_approval, measured, serving, unknown
from workers.host.home import RobotHome

NOBODY, VIEWER, OPERATOR = "nobody", "viewer", "operator"
WHO_MAY = {
    "GET /enter": NOBODY,
    "POST /enter": NOBODY,
    "POST /leave": VIEWER,
    "GET /static/{name}": NOBODY,
    "GET /": VIEWER,
    "GET /trials": VIEWER,
    "GET /trials/{number}": VIEWER,
    "GET /state": VIEWER,
    "GET /live": VIEWER,
    "GET /trials/{number}/clip": VIEWER,
    "GET /figure.svg": VIEWER,
    "GET /attachments/{sha256}": VIEWER,
    "GET /export/{form}": VIEWER,
    "POST /trials/{number}/approve": OPERATOR,
    "POST /trials/{number}/withdraw": OPERATOR,
    "POST /trials/{number}/reject": OPERATOR,
    "POST /trials/{number}/resolve": OPERATOR,
    "POST /trials/{number}/amend": OPERATOR,
    "POST /trials/{number}/attach": OPERATOR,
}
FORM = "application/x-www-form-urlencoded"


@pytest.fixture
def waiting(tmp_path):
    awaiting_approval(tmp_path / "campaign")
    with serving(tmp_path / "campaign") as served:
        yield served


@pytest.fixture
def lost(tmp_path):
    unknown(tmp_path / "campaign")
    with serving(tmp_path / "campaign") as served:
        yield served


@pytest.fixture
def done(tmp_path):
    measured(tmp_path / "campaign")
    with serving(tmp_path / "campaign") as served:
        yield served


def together(count, act):
    """The same act by many threads at one moment; what each got."""
    start = threading.Barrier(count)

    def one(_):
        start.wait()
        return act()

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(one, range(count)))


def test_every_address_has_a_role():
    routes = [route for part in (entrance, looks, decisions) for route in part.router.routes]
    assert {f"{method} {route.path}" for route in routes for method in route.methods} == set(WHO_MAY)


@pytest.mark.parametrize("address", WHO_MAY)
def test_a_role_opens_what_it_may_and_nothing_else(shared, address):
    method, path = address.split()
    path = path.format(number=0, name="console.css", sha256="0" * 64, form="csv")
    for who, token in ((NOBODY, "wrong"), (VIEWER, shared.viewer), (OPERATOR, shared.operator)):
        answer = shared.program(token).request(method, shared.url + path, data=b"", stream=True, timeout=60)
        allowed = [NOBODY, VIEWER, OPERATOR].index(who) >= [NOBODY, VIEWER, OPERATOR].index(WHO_MAY[address])
        refused = answer.status_code == (401 if who == NOBODY else 403)
        if address != "POST /enter":  # which refuses everybody who brings no token
            assert refused is not allowed, (who, answer.status_code)
        answer.close()


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("console") / "campaign"
    awaiting_approval(folder)
    with serving(folder) as served:
        yield served


def test_an_approval_goes_into_the_journal_with_the_name_of_the_token(waiting):
    ada = waiting.browser(waiting.operator)
    form = ada.form("/trials/0/approve")
    assert ada.send("/trials/0/approve", **form, minutes="5").status_code == 303
    assert waiting.states() == ["approved"]
    assert waiting.events()[-1].who == "operator: Ada"
    assert ada.send("/trials/0/withdraw", **ada.form("/trials/0/withdraw")).status_code == 303
    assert waiting.states() == ["checked"]


def test_a_page_that_is_out_of_date_decides_nothing_and_says_why(waiting):
    first, second = waiting.browser(waiting.operator), waiting.browser(waiting.operator)
    stale = second.form("/trials/0/reject")
    first.send("/trials/0/approve", **first.form("/trials/0/approve"))
    answer = second.send("/trials/0/reject", **stale, note="it would fall")
    assert answer.status_code == 409
    assert "it is approved now, by operator: Ada" in answer.text
    assert waiting.states() == ["approved"]


@pytest.mark.parametrize(
    ("action", "fields"),
    [("approve", {"minutes": "5"}), ("reject", {"note": "it would fall"})],
)
def test_a_decision_sent_by_twenty_threads_is_one_event(waiting, action, fields):
    before = len(waiting.events())
    ada = waiting.program(waiting.operator)
    seen = {"seen": "2", **fields}
    answers = together(20, lambda: ada.post(f"{waiting.url}/trials/0/{action}", seen, timeout=60).status_code)
    assert 200 in answers
    assert set(answers) <= {200, 409}
    assert len(waiting.events()) == before + 1


def test_a_resolution_and_an_amendment_sent_by_twenty_threads_are_one_event_each(lost):
    ada, before = lost.browser(lost.operator), len(lost.events())
    told = {"outcome": "measured", "f": "62.5", "y": "0,1", "note": "tape", "at_rest": "yes"}
    form = ada.form("/trials/0/resolve")
    answers = together(20, lambda: ada.send("/trials/0/resolve", **form, **told).status_code)
    assert 303 in answers
    assert len(lost.events()) == before + 1
    form = ada.form("/trials/0/amend", "/trials/0")
    told = {"f": "62.6", "y": "0.1", "note": "read again"}
    answers = together(20, lambda: ada.send("/trials/0/amend", **form, **told).status_code)
    assert 303 in answers
    assert len(lost.events()) == before + 2
    assert [json.loads(event.body)["f"] for event in lost.events()[-2:]] == [62.5, 62.6]


def test_a_file_sent_by_twenty_threads_is_kept_once(done):
    ada = done.browser(done.operator)
    before, key = len(attachments(done.folder)), ada.form("/trials/0/attach", "/trials/0")["key"]

    def send():
        files = {"file": ("clip.mp4", b"moving pictures")}
        return ada.session.post(
            f"{done.url}/trials/0/attach", {"key": key}, files=files, timeout=60
        ).status_code

    assert set(together(20, send)) == {200}
    assert len(attachments(done.folder)) == before + 1


def test_a_stop_sent_by_twenty_threads_is_one_line_of_the_ledger(waiting):
    ada = waiting.browser(waiting.operator)
    form = ada.form(waiting.stop_url)
    answers = together(20, lambda: requests.post(waiting.stop_url, form, timeout=60).text)
    assert all("no host is at the robot" in text for text in answers)
    ledger = RobotHome(waiting.home, "any").ledger.entries()
    assert [entry.event for entry in ledger].count("stopped") == 1
    page = ada.page()
    assert "The robot was stopped by Ada" in page
    assert f"svaedc hardware clear rehearsal:quadratic-30d --home {waiting.home}" in page


def test_a_stop_needs_the_key_of_the_robot(waiting):
    answer = requests.post(waiting.stop_url, {"key": "guessed"}, timeout=60)
    assert (answer.status_code, "EMERGENCY STOP" in answer.text) == (403, True)
    assert not RobotHome(waiting.home, "any").latch.is_set


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": None}, 403),
        ({"Content-Length": "1000000000"}, 413),
        ({"Content-Length": "-1"}, 400),
    ],
)
def test_a_form_of_another_site_or_of_a_gigabyte_is_refused(waiting, headers, status):
    ada = waiting.browser(waiting.operator)
    form = ada.form("/trials/0/approve")
    host = waiting.url.removeprefix("http://")
    lines = {"Host": host, "Origin": waiting.url, "Content-Type": FORM, **headers}
    body = "&".join(f"{name}={value}" for name, value in form.items())
    lines.setdefault("Content-Length", str(len(body)))
    lines["Cookie"] = "; ".join(f"{name}={value}" for name, value in ada.session.cookies.items())
    head = "".join(f"{name}: {value}\r\n" for name, value in lines.items() if value is not None)
    address = host.split(":")
    with socket.create_connection((address[0], int(address[1])), 60) as raw:
        raw.sendall(f"POST /trials/0/approve HTTP/1.1\r\n{head}\r\n{body}".encode())
        assert int(raw.recv(4096).split()[1]) == status
    assert waiting.states() == ["checked"]


def test_a_body_without_a_length_is_cut_where_it_gets_too_long(waiting, monkeypatch):
    monkeypatch.setattr(guards, "FORM_BYTES", 1_000)
    endless = (b"note=" + 100 * b"x" for _ in range(10_000))
    answer = waiting.program(waiting.operator).post(
        f"{waiting.url}/trials/0/reject", data=endless, timeout=60
    )
    assert answer.status_code == 413


def test_a_form_needs_the_key_of_its_session(waiting):
    ada = waiting.browser(waiting.operator)
    form = ada.form("/trials/0/approve") | {"key": "guessed"}
    assert ada.send("/trials/0/approve", **form).status_code == 403
    assert waiting.states() == ["checked"]


def test_a_revoked_token_ends_pages_that_are_open(waiting):
    from cluster.console.access import AccessTokens

    ada = waiting.browser(waiting.operator)
    AccessTokens(waiting.home).revoke("Ada")
    answer = ada.session.get(waiting.url, timeout=60, allow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/enter")


def test_tokens_cannot_be_guessed_without_end(waiting):
    tries = [
        requests.post(f"{waiting.url}/enter", {"token": "x"}, headers={"Origin": waiting.url}, timeout=60)
        for _ in range(12)
    ]
    assert [answer.status_code for answer in tries][-2:] == [429, 429]


HOSTILE = "<script>alert(1)</script>\"'&{{7*7}}"


def test_names_notes_and_files_cannot_inject(done):
    ada = done.browser(done.operator)
    key = ada.form("/trials/0/attach", "/trials/0")["key"]
    for name in (f"../../{HOSTILE}.html", "..", "a/b\\c.txt", "\x00x", "x" * 900):
        files = {"file": (name, b"<html><script>alert(1)</script>")}
        answer = ada.session.post(
            f"{done.url}/trials/0/attach", {"key": key, "note": HOSTILE}, files=files, timeout=60
        )
        assert answer.status_code == 200, answer.text
    ada.send("/trials/0/amend", **ada.form("/trials/0/amend", "/trials/0"), f="1", y="0", note=HOSTILE)
    for path in ("/", "/trials", "/trials/0"):
        page = ada.page(path)
        assert "<script>alert" not in page
        assert "49" not in re.findall(r"&#34;&#39;&amp;(\S{0,6})", page)
    kept = attachments(done.folder)[-1]
    answer = ada.session.get(f"{done.url}/attachments/{kept.sha256}", timeout=60)
    assert answer.headers["content-disposition"].startswith("attachment")
    assert answer.headers["content-type"] == "application/octet-stream"
    assert all(
        path.parent == done.folder / "attachments" for path in (done.folder / "attachments").rglob("*")
    )


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("../../etc/passwd", "passwd"),
        ("C:\\x\\clip.mp4", "clip.mp4"),
        ("..", "attachment"),
        ("a\nb", "a_b"),
        ("", "attachment"),
    ],
)
def test_a_name_becomes_one_of_a_file(name, kept):
    assert decisions.harmless_name(name) == kept


@pytest.mark.parametrize(
    ("told", "reason"),
    [
        ({"f": "high"}, "f must be a number, got &#39;high&#39;"),
        ({"f": "nan"}, "needs a finite objective, got nan"),
        ({"f": "1e9"}, "type it again with --confirm 1e+09"),
        ({"y": "2"}, "a badness in [0, 1], got 2.0"),
        ({"note": ""}, "needs a note"),
        ({"note": 2_001 * "x"}, "at most 2000 characters"),
        ({"outcome": "fine"}, "outcome must be one of measured, failed, aborted"),
        ({"at_rest": ""}, "seen the robot stand still"),
        ({"seen": ""}, "which version of the trial was seen"),
    ],
)
def test_a_resolution_that_is_none_is_refused_with_its_reason(lost, told, reason):
    ada, before = lost.browser(lost.operator), len(lost.events())
    form = ada.form("/trials/0/resolve") | {
        "outcome": "measured", "f": "60", "y": "0.1", "note": "tape", "at_rest": "yes", **told,
    }  # fmt: skip
    answer = ada.send("/trials/0/resolve", **form)
    assert answer.status_code == 422
    assert reason in answer.text
    assert len(lost.events()) == before


def test_what_is_not_there_is_told(waiting):
    ada = waiting.browser(waiting.operator)
    for path in (
        "/trials/7",
        "/trials/x",
        "/trials/-1",
        "/trials/0/clip",
        "/attachments/0",
        "/export/pickle",
        "/static/app.py",
        "/nowhere",
    ):
        answer = ada.session.get(waiting.url + path, timeout=60)
        assert answer.status_code == 404, path
        assert "Not there" in answer.text


def test_a_program_gets_states_and_reasons_as_json(waiting):
    vera = waiting.program(waiting.viewer)
    state = vera.get(f"{waiting.url}/state", timeout=60).json()
    assert (state["phase"], state["trials"][0]["state"]) == ("awaits approval", "checked")
    answer = vera.post(f"{waiting.url}/trials/0/approve", {"seen": "2"}, timeout=60)
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["detail"] == "Vera may look, and not decide"


def test_an_open_page_is_told_of_every_change(waiting):
    vera, ada = waiting.program(waiting.viewer), waiting.program(waiting.operator)
    with vera.get(f"{waiting.url}/live", stream=True, timeout=60) as stream:
        lines = (line for line in stream.iter_lines() if line)
        first = json.loads(next(lines).removeprefix(b"data: "))
        ada.post(f"{waiting.url}/trials/0/approve", {"seen": "2"}, timeout=60)
        later = next(
            told
            for line in lines
            if (told := json.loads(line.removeprefix(b"data: ")))["mark"] != first["mark"]
        )
    assert (first["phase"], later["phase"]) == ("awaits approval", "ready")


def test_exports_are_those_of_the_command_line(done):
    from cluster.hardware.record.export import export

    vera = done.program(done.viewer)
    for form in ("csv", "jsonl"):
        assert vera.get(f"{done.url}/export/{form}", timeout=60).text == export(done.folder, form, None)
    assert vera.get(f"{done.url}/export/parquet", timeout=60).content[:4] == b"PAR1"


def test_pages_are_small_and_bring_nothing_from_elsewhere(done):
    ada = done.browser(done.operator)
    for path in ("/", "/trials", "/trials/0"):
        answer = ada.session.get(done.url + path, timeout=60)
        assert len(answer.content) < 100_000
        assert not re.findall(r'(?:src|href)="(?!/)[^"#]', answer.text)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert f"form-action 'self' {done.stop_url.removesuffix('/stop')};" in policy
        assert answer.headers["cache-control"] == "no-store"
