"""Every action of the console in a real browser, on a desk and on a phone."""

import subprocess
import sys
import time
from contextlib import closing

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from cluster.hardware.record.attachments import attachments
from tests.chromium import QUIET, found
from tests.cluster.console.served import awaiting_approval, book, measured, serving, unknown
from workers.host.home import RobotHome

PHONE, DESK = (390, 844), (1280, 900)
SECONDS = 60


def driver(profile, *, scripts=True):
    chromium, service = found("chromium", "chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for option in (*QUIET, f"--user-data-dir={profile}"):
        options.add_argument(option)
    if not scripts:
        options.add_experimental_option("prefs", {"profile.managed_default_content_settings.javascript": 2})
    return webdriver.Chrome(options=options, service=Service(service))


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    browser = driver(tmp_path_factory.mktemp("profile"))
    yield browser
    browser.quit()


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A browser that runs no scripts."""
    browser = driver(tmp_path_factory.mktemp("profile"), scripts=False)
    yield browser
    browser.quit()


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "campaign"


def enter(browser, served, size=DESK, token=None):
    browser.delete_all_cookies()
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size is PHONE},
    )
    browser.get(f"{served.url}/enter")
    browser.find_element(By.NAME, "token").send_keys(token or served.operator)
    browser.find_element(By.CSS_SELECTOR, "main button").click()
    wait(browser, "h1", "")


def wait(browser, selector, text):
    """Until an element of the page says something."""
    WebDriverWait(browser, SECONDS, ignored_exceptions=(Exception,)).until(
        lambda page: text in page.find_element(By.CSS_SELECTOR, selector).text
    )


def form(browser, action):
    return browser.find_element(By.CSS_SELECTOR, f'form[action$="{action}"]')


def press(browser, action):
    button = form(browser, action).find_element(By.TAG_NAME, "button")
    WebDriverWait(browser, SECONDS).until(lambda _: button.is_enabled())
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", button)
    button.click()


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
def test_a_trial_is_approved_withdrawn_and_rejected(chromium, folder, size):
    awaiting_approval(folder)
    with serving(folder) as served:
        enter(chromium, served, size)
        wait(chromium, "h1", "Awaits approval")
        wait(chromium, "main", "Nobody has the robot: the start command does not run.")
        assert_fits(chromium)
        Select(form(chromium, "/approve").find_element(By.NAME, "minutes")).select_by_value("5.0")
        press(chromium, "/approve")
        wait(chromium, "h2", "Trial 0 random, approved")
        press(chromium, "/withdraw")
        wait(chromium, "h2", "Trial 0 random, checked")
        form(chromium, "/reject").find_element(By.NAME, "note").send_keys("it would fall")
        press(chromium, "/reject")
        wait(chromium, "h1", "Ready")
        assert [event.new for event in served.events()][-3:] == ["approved", "checked", "rejected"]
        assert_quiet(chromium)


def assert_fits(browser):
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")


def assert_quiet(browser):
    assert [entry for entry in browser.get_log("browser") if entry["source"] != "network"] == []


def test_what_became_of_a_lost_trial_is_said_and_corrected(chromium, folder):
    unknown(folder)
    with serving(folder) as served:
        enter(chromium, served, PHONE)
        wait(chromium, "h1", "Awaits resolution")
        said = form(chromium, "/resolve")
        said.find_element(By.CSS_SELECTOR, "[value=measured]").click()
        for name, text in (("f", "62.5"), ("y", "0.25"), ("note", "read off the tape")):
            said.find_element(By.NAME, name).send_keys(text)
        press(chromium, "/resolve")  # without having seen the robot: the browser itself objects
        assert served.states() == ["unknown"]
        said.find_element(By.NAME, "at_rest").click()
        press(chromium, "/resolve")
        wait(chromium, "h1", "Ready")
        assert served.states() == ["measured"]
        chromium.get(f"{served.url}/trials/0")
        f = form(chromium, "/amend").find_element(By.NAME, "f")
        f.clear()
        f.send_keys("1000")
        form(chromium, "/amend").find_element(By.NAME, "note").send_keys("read again")
        press(chromium, "/amend")
        wait(chromium, ".warning", "must lie in [30, 120], got 1000")
        chromium.back()
        f = form(chromium, "/amend").find_element(By.NAME, "f")
        f.clear()
        f.send_keys("63")
        press(chromium, "/amend")
        wait(chromium, "dl", "63.000, amended 1 times")


def test_a_file_is_attached_and_comes_back(chromium, folder, tmp_path):
    measured(folder)
    with serving(folder) as served:
        enter(chromium, served, PHONE)
        chromium.get(f"{served.url}/trials/0")
        (tmp_path / "photo.jpg").write_bytes(b"a photograph")
        form(chromium, "/attach").find_element(By.NAME, "file").send_keys(str(tmp_path / "photo.jpg"))
        form(chromium, "/attach").find_element(By.NAME, "note").send_keys("how it lay")
        press(chromium, "/attach")
        wait(chromium, "main ul", "photo.jpg how it lay")
        kept = attachments(folder)[-1]
        assert (kept.name, kept.who, (folder / kept.file).read_bytes()) == (
            "photo.jpg",
            "operator: Ada",
            b"a photograph",
        )
        chromium.get(f"{served.url}/trials")
        assert chromium.execute_script("return document.querySelector('img.wide').naturalWidth") > 100
        assert_fits(chromium)


@pytest.mark.parametrize("page", ["/", "/trials", "/trials/0", "/trials/9"])
def test_stop_is_on_every_page_and_needs_no_script(plain, folder, page):
    measured(folder)
    with serving(folder) as served:
        enter(plain, served, PHONE, served.viewer)
        plain.get(served.url + page)
        form(plain, "/stop").find_element(By.TAG_NAME, "button").click()
        wait(plain, "h1", "STOP")
        assert RobotHome(served.home, "any").latch.is_set
        plain.find_element(By.TAG_NAME, "a").click()
        if page != "/trials/9":
            wait(plain, "section", "stopped by Vera")


def test_escape_stops(chromium, folder):
    awaiting_approval(folder)
    with serving(folder) as served:
        enter(chromium, served)
        chromium.find_element(By.TAG_NAME, "body").send_keys(Keys.ESCAPE)
        wait(chromium, "h1", "STOP")
        assert RobotHome(served.home, "any").latch.is_set


def test_a_page_that_is_looked_at_is_loaded_again_by_itself_and_one_that_is_written_on_is_not(
    chromium, folder
):
    awaiting_approval(folder)
    with serving(folder) as served:
        enter(chromium, served)
        ada = served.program(served.operator)
        ada.post(f"{served.url}/trials/0/approve", {"seen": "2"}, timeout=SECONDS)
        wait(chromium, "h2", "approved")
        form(chromium, "/reject").find_element(By.NAME, "note").send_keys("half a sen")
        ada.post(f"{served.url}/trials/0/withdraw", {"seen": "3"}, timeout=SECONDS)
        wait(chromium, "#outdated", "This page is out of date")
        press(chromium, "/reject")
        wait(chromium, ".warning", "it is checked now, by operator: Ada")
        assert served.states() == ["checked"]


def test_a_viewer_sees_and_is_offered_nothing(chromium, folder):
    awaiting_approval(folder)
    with serving(folder) as served:
        enter(chromium, served, DESK, served.viewer)
        wait(chromium, "h1", "Awaits approval")
        assert chromium.find_elements(By.CSS_SELECTOR, 'form[action^="/trials"]') == []


MOVING = """
import sys
from contextlib import closing
from pathlib import Path
from cluster.hardware import operator
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
folder = Path(sys.argv[1])
folder.mkdir()
identity = identify("franka-rehearsal", "random", 1, 3, 20, None, Approval.OPERATOR)
with closing(Executor(CampaignPlan(identity, folder, None, 60.0, None, folder.parent / "home"))) as executor:
    executor.advance()
    operator.approve(folder, 0, "Ada")
    print("approved", flush=True)
    executor.advance()
"""


def test_a_motion_is_watched_and_aborted(chromium, folder):
    moving = subprocess.Popen([sys.executable, "-c", MOVING, folder], stdout=subprocess.PIPE, text=True)
    try:
        assert moving.stdout.readline() == "approved\n"
        with serving(folder) as served:
            enter(chromium, served, PHONE)
            wait(chromium, "h1", "Running")
            wait(chromium, "#steps", "of 500 commands")
            wait(chromium, "main", "The start command runs.")
            seen = sent(chromium)
            WebDriverWait(chromium, SECONDS).until(lambda page: sent(page) > seen + 5)
            assert chromium.find_element(By.CSS_SELECTOR, "tr[data-channel] th").text == "panda_joint1"
            abort = chromium.find_element(By.CSS_SELECTOR, ".danger")
            chromium.execute_script("arguments[0].scrollIntoView({block: 'center'})", abort)
            abort.click()
            wait(chromium, "h1", "STOP")
            wait(chromium, "p", "its motors hold")
            moving.wait(SECONDS)
            with closing(book(folder)) as opened:
                assert str(opened.trial(0).state) == "aborted"
    finally:
        moving.kill()
        moving.communicate()


def sent(browser):
    return float(browser.execute_script("return document.getElementById('progress')?.value ?? 0"))


def test_a_page_says_when_the_console_is_silent(chromium, folder):
    awaiting_approval(folder)
    with serving(folder) as served:
        enter(chromium, served)
    deadline = time.monotonic() + SECONDS
    while chromium.find_element(By.ID, "silent").get_attribute("hidden") is not None:
        assert time.monotonic() < deadline
        time.sleep(0.2)
