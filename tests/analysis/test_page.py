"""The page in a browser: everything that can be chosen is chosen."""

from __future__ import annotations

import functools
import itertools
import os
import re
import threading
from pathlib import Path
from time import monotonic
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace
from page_text import PLAN, broken, played, store, words

from roboirg.analysis.page.page_server import run_server
from roboirg.analysis.page.report import write_report
from roboirg.records.episode_log import EpisodeLog, log_path
from roboirg.runs.play.video_writer import VideoWriter

pytest.importorskip("jinja2")
pytestmark = pytest.mark.browser

WAIT_S = 300.0
FILM = "videos/x.mp4"
LOG = b"<b>some words</b>"
PRINTED = Path(__file__).with_name("printed_page.txt")


@functools.cache
def records_of_page():
    """Return the records of the plan: the forgetful policy fails where it must remember.

    The last is an error, and episode 0 of PickXtimes was filmed.
    """
    *found, last = played(PLAN)
    filmed = [
        replace(record, video=FILM if (record.task, record.episode) == ("PickXtimes", 0) else None)
        for record in found
    ]
    return (*filmed, broken(last))


@pytest.fixture(scope="module")
def run_with_a_film(tmp_path_factory):
    """A run with records and one real film: 100 steps, every 8th of them, and the end."""
    folder = tmp_path_factory.mktemp("run")
    film = VideoWriter(folder / FILM)
    film.caption = "Do it."
    world = SimpleNamespace(picture=lambda _camera: np.full((256, 256, 3), 99, np.uint8))
    for step in range(0, 101, 8):
        film.add_frame(world, is_demonstration=step < 20)
    assert film.finish()
    with EpisodeLog(log_path(folder, records_of_page()[0].slug)) as log:
        os.write(log.descriptor, LOG)
    return store(folder, records_of_page(), PLAN)


@pytest.fixture(scope="module")
def page_file(run_with_a_film):
    return write_report(run_with_a_film)


@pytest.fixture
def page(open_page, page_file):
    with open_page(page_file.as_uri()) as page:
        yield page


def count_shown(page):
    """Return how many episodes the page says that it lists, as in "1,203 of 5,000"."""
    return int(page.locator("#shown").inner_text().split(" of ")[0].replace(",", ""))


def count_of_records(**fields):
    """Return how many records have all these values, as in ``policy="forgetful"``."""
    found = list(records_of_page())
    for name, value in fields.items():
        found = [record for record in found if getattr(record, name) == value]
    return len(found)


def opened_first_row(page, **filters):
    """Set filters, as with ``task="PickXtimes"``, open the first episode left, and return it."""
    for name, value in filters.items():
        page.select_option(f"#filters [name={name}]", value)
    row = page.locator("#rows > li").first
    row.locator("h3 button").click()
    return row


def open_breakdowns(page):
    for summary in page.locator("#kinds summary").all():
        summary.press("Enter")


def focused_element(page, what="innerText"):
    """Return something of the element that has the keyboard's focus, by default its text."""
    return str(page.evaluate(f"document.activeElement.{what}"))


@pytest.mark.slow
def test_each_filter_leaves_the_episodes_that_fit_and_reset_brings_all_back(page):
    """The expected counts are counted in the records of the page; one episode ended in an error."""
    everything = len(records_of_page())
    counting = count_of_records(task="StopCube") + count_of_records(task="PickXtimes")
    assert count_shown(page) == everything

    for name, value, count in [
        ("policy", "forgetful (privileged)", count_of_records(policy="forgetful")),
        ("task", "any counting", counting),
        ("form", "resolved", count_of_records(form="resolved")),
        ("outcome", "error", 1),
        ("failure", "policy", 1),
    ]:
        page.select_option(f"#filters [name={name}]", value)
        assert count_shown(page) == count, (name, value)
        assert 0 < count < everything
        page.click("#filters button[type=reset]")
        assert count_shown(page) == everything


@pytest.mark.slow
def test_a_search_finds_words_in_any_case_and_says_if_there_is_nothing(page):
    """All failures have the cause "picked up the wrong cube"."""
    page.fill("[name=words]", "WRONG  cube")
    assert count_shown(page) == count_of_records(outcome="failure")

    page.fill("[name=words]", "words in no record")
    assert page.locator("#nothing").is_visible()


@pytest.mark.slow
def test_an_address_of_the_page_leads_to_the_same_filters_and_page(page):
    """So that it can be sent to somebody else."""
    page.select_option("#filters [name=task]", "VideoUnmask")
    page.get_by_label("Next page").click()
    address = page.url

    page.goto("about:blank")
    page.goto(address)

    assert "page=2" in address
    assert count_shown(page) == count_of_records(task="VideoUnmask")
    assert "page 2 of" in page.locator("#pager").inner_text()


@pytest.mark.slow
def test_an_address_of_an_episode_opens_it_and_clears_filters_that_would_hide_it(page, page_file):
    """The address names an episode of VideoUnmask by its key (`at`), and a filter for StopCube.

    In the page, the list item of an episode has the id "e-" and its key. The filter would hide it,
    so all episodes are listed; that of the key is open and has the keyboard's focus.
    """
    key = opened_first_row(page, task="VideoUnmask").get_attribute("id").removeprefix("e-")
    page.goto("about:blank")

    page.goto(f"{page_file.as_uri()}#?task=StopCube&at={key}")

    assert count_shown(page) == len(records_of_page())
    assert page.locator(f"#e-{key} .inside").is_visible()
    assert focused_element(page, "closest('li').id") == f"e-{key}"


@pytest.mark.slow
def test_arrow_keys_move_between_cells_of_the_table_whose_tip_says_what_is_in_focus(page):
    """The table's rows are all tasks, a suite, PickXtimes, …; its columns explicit, direct, ….

    From the first cell, the arrow to the right leads to direct, and two down to PickXtimes. The
    escape key hides the tip. A screen reader hears the gap in the cell's label.
    """
    tip = page.locator("#tip")
    page.locator(".cell").first.focus()

    page.keyboard.press("ArrowRight")
    tip.wait_for()
    assert "listener (privileged), all tasks, direct" in tip.inner_text()
    assert "points to explicit" in focused_element(page, "getAttribute('aria-label')")

    page.keyboard.press("Escape")
    assert tip.is_hidden()

    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    assert "PickXtimes, direct" in tip.inner_text()


@pytest.mark.slow
def test_enter_lists_the_episodes_of_the_cell_in_focus(page):
    """The cell is the listener's of PickXtimes in direct: three episodes were played there."""
    cell = page.locator(".cell[aria-label*='PickXtimes, direct']").first
    cell.focus()

    page.keyboard.press("Enter")

    assert count_shown(page) == 3
    assert page.input_value("#filters [name=task]") == "PickXtimes"
    assert page.input_value("#filters [name=form]") == "implicit"
    assert focused_element(page, "id") == "episodes"


def cell_of_the_forgetful_policy(page):
    """Return the second policy's cell of all tasks in the setting direct."""
    return page.locator(".map").nth(1).locator("tr.all .cell").nth(1)


def test_a_cell_shows_the_rate_or_the_gap_to_explicit(page):
    """The forgetful policy wins all of explicit, and nothing of direct."""
    cell = cell_of_the_forgetful_policy(page)
    assert cell.locator("b").inner_text() == "0"
    assert cell.locator("small").inner_text() == "−100"

    page.locator("#map-controls").get_by_text("gap to explicit").click()

    assert cell.locator("b").inner_text() == "−100"


def test_a_click_on_a_cell_filters_the_episodes_to_those_that_it_counts(page):
    """The cell is of the forgetful policy in direct, over all tasks. It wins nothing there.

    Of its 9 episodes, three of each task, 6 are easy. If only these are counted, the tip says so,
    and a click on the cell lists them alone.
    """
    cell = cell_of_the_forgetful_policy(page)
    page.select_option("#level", label="easy")

    cell.hover()
    tip = page.locator("#tip").inner_text()
    cell.click()

    assert re.search("0 of 6 trials.*95 % interval", tip, re.DOTALL)
    assert page.input_value("#filters [name=difficulty]") == "easy"
    assert count_shown(page) == 6


def test_a_click_on_a_part_of_a_bar_filters_the_episodes_to_those_that_failed_so(page):
    """The second bars are of the forgetful policy, which fails in every implicit setting.

    The first part of the first of them is its failures of grounding, of whatever kind.
    """
    bars = page.locator("#bars .map").nth(1)

    bars.locator(".end.grounding").first.click()

    assert page.input_value("#filters [name=failure]") == "any grounding"
    assert page.input_value("#filters [name=policy]") == "forgetful (privileged)"
    assert count_shown(page) > 0


def test_a_word_that_refers_back_and_what_it_refers_to_light_up_together(page):
    """As *it* (the anaphor) and *the red cube* (its antecedent): by mouse and by keyboard."""
    row = opened_first_row(page, task="PickXtimes", setting="contextual", form="implicit")
    anaphor = row.locator("mark.anaphor").last
    keys = anaphor.get_attribute("data-keys")
    antecedent = row.locator(f"mark.antecedent[data-keys='{keys}']")

    for act in (anaphor.hover, antecedent.focus, antecedent.hover, anaphor.focus):
        act()
        assert row.locator("mark.lit").count() == row.locator(f"mark[data-keys='{keys}']").count()
        assert row.locator(f"mark.lit:not([data-keys='{keys}'])").count() == 0

    page.locator("h1").hover()
    page.locator("h1").evaluate("one => document.activeElement.blur()")
    assert row.locator("mark.lit").count() == 0


def test_a_word_that_refers_back_and_what_it_refers_to_have_the_same_number(page):
    """An anaphor, such as *it*, and its antecedent, the words that named the thing first."""
    row = opened_first_row(page, task="PickXtimes", setting="contextual", form="implicit")
    anaphor = row.locator("mark.anaphor").last
    antecedent = row.locator(f"mark.antecedent[data-keys='{anaphor.get_attribute('data-keys')}']")

    assert antecedent.get_attribute("data-number") == anaphor.get_attribute("data-number")
    assert "first named" in antecedent.get_attribute("aria-description")


def test_a_screen_reader_finds_one_heading_no_skipped_level_and_names_of_all_controls(page):
    """The page has one main part and one title; headings go down by one level at a time.

    Every button, list and field has a text or a label, and no two elements have the same id.
    """
    assert page.locator("main").count() == page.locator("h1").count() == 1

    levels = page.locator("h1,h2,h3,h4").evaluate_all("all => all.map(one => +one.tagName[1])")
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))

    unnamed = page.evaluate(
        "[...document.querySelectorAll('button,select,input')].filter(one => !(one.innerText || "
        "one.ariaLabel || one.labels?.length)).map(one => one.outerHTML)"
    )
    assert unnamed == []

    identities = page.evaluate("[...document.querySelectorAll('[id]')].map(one => one.id)")
    assert len(set(identities)) == len(identities)


def test_the_text_of_the_page_is_as_stored(page):
    """With every breakdown and a failed episode opened."""
    open_breakdowns(page)
    opened_first_row(
        page,
        policy="forgetful (privileged)",
        task="PickXtimes",
        setting="contextual",
        form="implicit",
    )

    assert words(page.locator("main").inner_text()) == PRINTED.read_text("utf-8")


def test_an_episode_leads_to_others_of_its_scene_although_filters_hide_them(page):
    """The filters are cleared."""
    row = opened_first_row(page, setting="contextual")

    row.locator(".scene-mates .chip", has_text="explicit").first.click()

    assert count_shown(page) == len(records_of_page())
    assert "explicit" in focused_element(page)


def test_an_episode_that_ended_in_an_error_shows_its_traceback(page):
    """The traceback has "<script>" in it, which must stay text."""
    row = opened_first_row(page, outcome="error")

    row.locator("summary").click()

    assert row.locator("pre").inner_text() == "Traceback <script>alert(1)</script>"


def test_enter_opens_and_closes_an_episode_and_an_arrow_key_moves_to_the_next(page):
    """The focus is on the first episode of the list."""
    first = page.locator("#rows h3 button").nth(0)
    second = page.locator("#rows > li").nth(1)
    first.focus()

    page.keyboard.press("Enter")
    assert first.get_attribute("aria-expanded") == "true"

    page.keyboard.press("Enter")
    assert first.get_attribute("aria-expanded") == "false"
    assert page.locator("#rows .detail").count() == 0

    page.keyboard.press("ArrowDown")
    assert focused_element(page, "closest('li').id") == second.get_attribute("id")


def wait_until(element, predicate):
    # Playwright's own wait evaluates text in the page, which the page's security policy forbids.
    give_up = monotonic() + WAIT_S
    while not element.evaluate(predicate):
        assert monotonic() < give_up, predicate
        element.page.wait_for_timeout(20)


@pytest.fixture
def served_page(open_page, run_with_a_film):
    """The page of the run behind a server, with the first two episodes opened."""
    written = write_report(run_with_a_film, served=True)
    with run_server(run_with_a_film.folder) as server:
        threading.Thread(target=server.serve_forever).start()
        with open_page(f"http://127.0.0.1:{server.port}/{written.name}") as page:
            page.locator("#rows h3 button").nth(0).click()
            page.locator("#rows h3 button").nth(1).click()
            yield page
        server.shutdown()


def test_a_served_page_links_what_was_printed_as_plain_text(served_page):
    """Only one episode printed something: words with markup, which must stay text."""
    (link,) = served_page.get_by_text("what was printed").all()

    answer = served_page.request.get(link.evaluate("one => one.href"))

    assert answer.body() == LOG
    assert answer.headers["content-type"] == "text/plain; charset=utf-8"


def test_a_served_page_plays_the_film_from_a_chosen_moment(served_page):
    """Needs a server that answers parts of a file; would find a film that starts at its begin.

    The cube is lowered at step 60, 20 steps before the end at 80 steps a second. The last picture
    is repeated for 0.8 s.
    """
    row = served_page.locator("#rows > li").first
    film = row.locator("video")

    row.locator(".moments button", has_text="lowered").click()
    wait_until(film, "one => one.currentTime > 0 && !one.seeking")

    time, length = film.evaluate("one => [one.currentTime, one.duration]")
    assert time == pytest.approx(length - 0.8 - 20 / 80, abs=0.06)
    assert film.get_attribute("src") == FILM


def test_a_click_on_the_track_below_a_film_goes_to_its_moment(served_page):
    """The film stands at the moment at which the cube is lowered, step 60 of 80.

    The track is a line with a button for each event of the episode; the first one, at step 40 or
    earlier, is clicked. So the film goes back, by more than 0.1 s, and a mark (`head`) shows where
    it is.
    """
    row = served_page.locator("#rows > li").first
    film = row.locator("video")
    row.locator(".moments button", has_text="lowered").click()
    wait_until(film, "one => one.currentTime > 0 && !one.seeking")
    lowered_at = film.evaluate("one => one.currentTime")

    row.locator(".track button.done, .track button.event").first.click()

    wait_until(film, f"one => one.currentTime < {lowered_at} - 0.1")
    assert row.locator(".head").is_visible()


def test_two_policies_are_compared_on_the_page_episode_by_episode(page):
    """Both policies played the same episodes. The listener, on the left, won all but no error.

    The forgetful policy, on the right, lost all implicit ones: in 4 settings of two tasks and 3 of
    StopCube, 3 each, 33 in all. One episode of it is an error. The filter *change* leaves those
    that only the *left* policy won, only the *right* one, *neither*, or with an *error*.
    """
    page.get_by_text("two policies", exact=True).click()

    for change, count in {"left": 33, "right": 0, "neither": 0, "error": 1}.items():
        page.select_option("#filters [name=change]", change)
        assert count_shown(page) == count, change


def test_two_compared_policies_can_change_sides(page):
    """The forgetful policy, now on the left, lost 33 episodes; the right one won them all."""
    page.get_by_text("two policies", exact=True).click()

    page.select_option("#filters [name=left]", "forgetful (privileged)")
    page.select_option("#filters [name=right]", "listener (privileged)")
    page.select_option("#filters [name=change]", "right")

    assert count_shown(page) == 33


def test_a_filter_by_outcome_does_not_count_while_two_policies_are_compared(page):
    """Failures were asked for before; in the comparison this filter is hidden.

    It could be about either policy. The comparison begins with the 33 episodes that only one won.
    """
    page.select_option("#filters [name=outcome]", "failure")

    page.get_by_text("two policies", exact=True).click()

    assert page.locator("#filters [name=outcome]").is_hidden()
    assert count_shown(page) == 33


def test_the_comparison_of_two_policies_opens_both_episodes_and_says_which_is_better(page):
    """A click on a count of the comparison lists its episodes, and one on an episode opens both."""
    page.get_by_text("two policies", exact=True).click()

    page.locator(".counts tr", has_text="direct").first.locator(".count").first.click()
    assert page.input_value("#filters [name=setting]") == "direct"

    page.locator("#rows h3 button").first.click()
    assert page.locator("#rows .inside section").count() == 2

    page.locator("#pair-summary summary").click()
    assert "listener (privileged) is better" in page.locator("#pair-summary").inner_text()


def compare_two_policies(page):
    """Choose the comparison of two policies, and open the first episode that it lists."""
    page.get_by_text("two policies", exact=True).click()
    page.locator("#rows h3 button").first.click()


def width_of(page):
    """Return how wide the page is in pixels, with what has to be scrolled to."""
    return page.evaluate("document.documentElement.scrollWidth")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_texts_of_the_page_have_enough_contrast(open_page, page_file, scheme):
    """`CONTRASTS` is a script that lists the texts whose contrast is below 4.5, as WCAG asks for.

    There are none in light and dark colors, with an episode open, and comparing two policies.
    """
    with open_page(page_file.as_uri(), color_scheme=scheme) as page:
        opened_first_row(page, policy="forgetful (privileged)", setting="contextual")
        assert page.evaluate(CONTRASTS) == []

        compare_two_policies(page)
        assert page.evaluate(CONTRASTS) == []


def test_the_page_fits_a_telephone(page):
    """In a window 400 pixels wide nothing is wider, so that the page does not scroll sideways.

    Neither with an episode and all breakdowns open, nor comparing two policies.
    """
    page.set_viewport_size({"width": 400, "height": 800})

    opened_first_row(page, policy="forgetful (privileged)", setting="contextual")
    open_breakdowns(page)
    assert width_of(page) == 400

    compare_two_policies(page)
    assert width_of(page) == 400


def outline_in_focus(page):
    """Return how wide the outline is of what has the focus, such as "3px".

    A radio button is not drawn; the label next to it has the outline.
    """
    return page.evaluate(
        "(() => { const one = document.activeElement; const at = one.type === 'radio' "
        "? one.nextElementSibling : one; return getComputedStyle(at).outlineWidth; })()"
    )


def test_the_tab_key_reaches_every_section_and_marks_where_it_is(page):
    """Pressed 60 times, more often than the page has controls, the key goes through all sections.

    They are known by the ids of their elements. Whatever has the focus has an outline of 3 pixels.
    """
    sections = set()

    for _ in range(60):
        page.keyboard.press("Tab")
        sections.add(focused_element(page, "closest('section,header,form,body').id"))
        assert outline_in_focus(page) == "3px", focused_element(page, "outerHTML")

    assert {"overview", "failures", "episodes", "filters", "map-controls"} <= sections


@pytest.mark.slow
def test_a_page_of_ten_thousand_episodes_draws_no_more_than_40_at_once(open_page, tmp_path):
    """Some records are repeated with other policy seeds; words are searched that many or none have.

    Each time the page's program looks at all records (`scanned`) and makes at most 40 list items
    (`drawn`), as it counts itself, and the whole page has fewer than 4,000 elements. So what is
    drawn does not grow with the run; no time is measured.
    """
    some = [replace(record, video=None) for record in records_of_page()]
    many = []
    for seed in range(10_000 // len(some) + 1):
        many += [replace(record, policy_seed=seed) for record in some]
    report = write_report(store(tmp_path, many[:10_000]))

    with open_page(report.as_uri()) as page:
        assert count_shown(page) == 10_000
        for words in ("cube", "words in no record", ""):
            page.fill("[name=words]", words)

            counters = page.evaluate("roboirg.counters")
            assert counters["scanned"] == 10_000
            assert counters["drawn"] <= 40
            assert page.evaluate("document.querySelectorAll('*').length") < 4000

        page.get_by_text("two policies", exact=True).click()
        assert page.evaluate("roboirg.counters.drawn") <= 40


CONTRASTS = """(() => {
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (color) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = color;
    canvas.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = ([r, g, b, a], below) => [r, g, b].map((one, at) => one * a + below[at] * (1 - a));
  const ground = (one) => {
    if (!one) return rgba(getComputedStyle(document.body).backgroundColor).slice(0, 3);
    const own = rgba(getComputedStyle(one).backgroundColor);
    return own[3] === 1 ? own.slice(0, 3) : over(own, ground(one.parentElement));
  };
  const light = (rgb) => {
    const [r, g, b] = rgb.map((one) => one / 255)
      .map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const poor = new Set();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const one = walker.currentNode.parentElement;
    const isSeen = walker.currentNode.data.trim() && one.checkVisibility()
      && !one.closest("script,style,option,.unseen,.skip,[aria-disabled]");
    if (!isSeen) continue;
    const below = ground(one);
    const [a, b] = [over(rgba(getComputedStyle(one).color), below), below].map(light);
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.add(`${one.tagName}.${one.className} ${ratio.toFixed(2)}`);
  }
  return [...poor];
})()"""
"""Texts whose contrast is below what WCAG's level AA asks of small ones."""
