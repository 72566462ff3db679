"""Reports in a real browser: no complaints, no network, blocks where run.h5 says, keys, sizes, themes."""

import base64
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from typer.testing import CliRunner

from blocksim.cli.commands import app
from blocksim.simulation.trajectory import Frames
from blocksim.view.report.page import write_report
from blocksim.view.report.subjects import StudyPage, read_folder, run_subject, study_subject
from tests.browser.conftest import PLAYER, Open, Opened
from tests.view.made_up import polygons
from tests.view.report.folders import write_experiment, write_run, write_sweep

pytestmark = pytest.mark.long
FRAMES_A_SECOND = 30.0
COLOURS = ((86, 180, 233), (230, 159, 0), (0, 158, 115))  # of the first blocks, in the order of the palette


def report(*arguments: object) -> None:
    result = CliRunner().invoke(app, ["report", *map(str, arguments), "--quiet"])
    assert result.exit_code == 0, result.output


def reported(
    folder: Path, name: str = "three_blocks", *, count: int, overrides: dict[str, object] | None = None
) -> tuple[Path, Frames]:
    """Write a run and its report; return the page and the frames."""
    frames = write_run(folder / "run", name, count=count, overrides=overrides)
    report(folder / "run", "--out", folder / "report.html")
    return folder / "report.html", frames


@pytest.fixture(scope="session")
def three(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Frames]:
    return reported(tmp_path_factory.mktemp("three"), count=21)


@pytest.fixture(scope="session")
def wall(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Frames]:
    return reported(tmp_path_factory.mktemp("wall"), "wall", count=12, overrides={"output.contacts": True})


@pytest.fixture(scope="session")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("swept")
    write_sweep(folder / "sweep", planned=True)
    report(folder / "sweep", "--out", folder / "report.html")
    return folder / "report.html"


def pixels(one: Opened) -> NDArray[np.int64]:
    """Return the canvas as RGB, a CSS pixel each."""
    url = one.page.evaluate(f"{PLAYER}.canvas.toDataURL()")
    picture = Image.open(io.BytesIO(base64.b64decode(url.split(",")[1])))
    return np.asarray(picture.convert("RGB"), dtype=np.int64)


def seen(one: Opened, colour: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return which pixels of the canvas have a colour."""
    return np.asarray((np.abs(pixels(one) - colour) <= 2).all(axis=-1))


def middle_of(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the middle of all pixels of one colour: that of a rectangle, however it is turned."""
    rows, columns = np.nonzero(mask)
    return 0.5 * np.array([columns.min() + columns.max() + 1, rows.min() + rows.max() + 1])


def test_polygons_have_their_corners_and_are_found_under_the_pointer(tmp_path: Path, open_page: Open) -> None:
    frames = write_run(tmp_path / "run", count=3)
    wedge = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
    stored = replace(read_folder(tmp_path / "run"), frames=polygons(frames, wedge))
    write_report([run_subject("part-1", stored)], tmp_path / "report.html")
    one = open_page(tmp_path / "report.html")
    one.page.evaluate(f"{PLAYER}.toggle('names')")
    scale = one.state()["scale"]
    own = np.count_nonzero(seen(one, COLOURS[0]))
    whole = 0.5 * (30.0 * scale) ** 2
    assert 0.85 * whole < own < whole  # less edges and the line along the upper side
    found = one.page.evaluate(f"[[5, 0], [14, 14]].map(([x, y]) => {PLAYER}.drawing.frames.isIn(0, x, y))")
    assert found == [True, False]
    assert one.complaints == []


def test_blocks_are_where_the_run_says_to_a_pixel(three: tuple[Path, Frames], open_page: Open) -> None:
    path, frames = three
    one = open_page(path)
    one.page.evaluate(f"{PLAYER}.toggle('names')")
    scale = one.state()["scale"]
    drawn = []
    for frame in (0, 12, 20):
        one.page.evaluate(f"{PLAYER}.show({frame})")
        state = one.state()
        drawn.append([middle_of(seen(one, colour)) for colour in COLOURS])
        assert np.abs(np.array(state["centres"]) - drawn[-1]).max() < 1.0
    places = np.stack([frames.x, -frames.y], axis=-1)[[0, 12, 20]]  # m; y goes down on a screen
    ways = 1e3 * scale * (places - places[0, 0])
    assert np.abs(np.array(drawn) - drawn[0][0] - ways).max() < 1.0
    one.keep("three-blocks")


def test_blocks_that_an_event_removed_are_neither_drawn_nor_found(tmp_path: Path, open_page: Open) -> None:
    write_run(tmp_path / "run", count=21)
    stored = read_folder(tmp_path / "run")
    assert stored.frames is not None
    vx = stored.frames.vx.copy()
    vx[10:, 2] = np.nan
    subject = run_subject("part-1", replace(stored, frames=replace(stored.frames, vx=vx)))
    write_report([subject], tmp_path / "report.html")
    one = open_page(tmp_path / "report.html")
    for frame, is_there in ((9, True), (10, False)):
        one.page.evaluate(f"{PLAYER}.show({frame})")
        x, y = one.state()["centres"][2]
        is_drawn = bool(seen(one, COLOURS[2]).any())
        assert (is_drawn, one.page.evaluate(f"{PLAYER}.blockAt({x}, {y}) === 2")) == (is_there, is_there)
    one.page.evaluate(f"{PLAYER}.mark(2)")
    assert "removed" in one.page.locator(".player .state").inner_text()


def test_loads_are_drawn_where_they_act_and_when_they_act(tmp_path: Path, open_page: Open) -> None:
    steps = {"kind": "steps", "times": [0.1], "factors": [1.0]}
    loads = [{"kind": "force", "body": "1", "magnitude": 5.0, "point": [-0.012, 0.0], "history": steps}]
    one = open_page(reported(tmp_path, count=21, overrides={"loads": loads})[0])
    red = (165, 0, 38)
    one.page.evaluate(f"{PLAYER}.show(9)")
    assert not seen(one, red).any()
    one.page.evaluate(f"{PLAYER}.show(10)")
    rows, columns = np.nonzero(seen(one, red))
    (x, y), scale = one.state()["centres"][0], one.state()["scale"]
    assert columns.max() == pytest.approx(x - 12.0 * scale, abs=2.0)
    assert 0.5 * (rows.min() + rows.max()) == pytest.approx(y, abs=1.5)
    one.page.keyboard.press("l")
    assert not seen(one, red).any()


def frames_a_second(one: Opened) -> float:
    """Return how often the player draws in a second when it draws as often as it can."""
    rate: float = one.page.evaluate(
        f"""() => new Promise((done) => {{
            const player = {PLAYER};
            const start = performance.now();
            let drawn = 0;
            const draw = (now) => {{
                player.show(drawn % player.frames.count);
                drawn += 1;
                if (now - start < 2000) requestAnimationFrame(draw);
                else done(drawn / ((now - start) / 1000));
            }};
            requestAnimationFrame(draw);
        }})"""
    )
    return rate


def test_thousand_blocks_open_and_play_at_thirty_frames_a_second(wall: tuple[Path, Frames], open_page: Open) -> None:
    path, frames = wall
    one = open_page(path)
    one.page.evaluate(f"{PLAYER}.show(11)")
    state = one.state()
    way = np.diff(np.array(state["centres"])[[0, 999]], axis=0)[0]
    expected = 1e3 * state["scale"] * np.array([np.ptp(frames.x[11, [0, 999]]), -np.ptp(frames.y[11, [0, 999]])])
    assert np.abs(way - expected).max() < 1.0
    for forces in (False, True):
        if forces:
            one.page.keyboard.press("f")
        rate = frames_a_second(one)
        print(f"1000 blocks{', 4000 forces' * forces}: {rate:.0f} frames a second")  # noqa: T201 - shown with -s
        assert rate >= FRAMES_A_SECOND
    one.keep("thousand-blocks")


def test_keys_move_the_player(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    press, scale = one.page.keyboard.press, one.state()["scale"]
    for key, frame in {"ArrowRight": 1, "Shift+ArrowRight": 11, "End": 20, "Home": 0}.items():
        press(key)
        assert one.state()["frame"] == frame
    press("Space")
    one.page.get_by_role("button", name="Pause").wait_for()
    one.page.wait_for_timeout(700)  # ms; the page forbids eval, by which Playwright waits for anything else
    assert 0 < one.state()["frame"] < 20
    press("Space")
    assert not one.state()["playing"]
    for key, factor in {"+": 1.25, "0": 1.0}.items():
        press(key)
        assert one.state()["scale"] == pytest.approx(factor * scale)
    press("b")
    assert "block 1" in one.page.locator(".player .state").inner_text()
    press("?")
    assert one.page.locator("details.keys").get_attribute("open") is not None


CONTROLS = (
    "button[data-act=first]",
    "button[data-act=next]",
    "[data-option=trails]",
    "label:has-text('names')",
    "input[type=range]",
    "details.keys summary",
    ".stage canvas",
    ".histories .over",
    "div[aria-label='Comparison']",
    "summary:has-text('Final state')",
    "h2",
)


@pytest.mark.parametrize("control", CONTROLS)
def test_keys_move_the_player_after_a_click(control: str, three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    one.page.locator(f"section:not([hidden]) {control}").first.click()
    one.page.evaluate(f"{PLAYER}.show(3)")
    one.page.keyboard.press("ArrowRight")
    assert one.state()["frame"] == 4
    one.page.keyboard.press("Space")
    assert one.state()["playing"]


def test_controls_that_tab_reaches_keep_their_own_keys(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    box = one.page.locator("[data-option=trails]")
    one.page.locator("[data-option=speed]").focus()
    one.page.keyboard.press("Tab")
    one.page.keyboard.press("Space")
    assert box.is_checked()
    assert not one.state()["playing"]
    assert box.evaluate("node => node === document.activeElement")


def test_names_are_drawn_when_ticked_however_small_the_blocks(wall: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(wall[0])
    box = one.page.get_by_label("names")
    assert not box.is_checked()  # there is no room for them
    before = pixels(one)
    box.check()
    changed = (pixels(one) != before).any(axis=-1)
    centres = np.array(one.state()["centres"])
    near = [changed[int(y) - 4 : int(y) + 5, int(x) - 4 : int(x) + 5].any() for x, y in centres]
    assert all(near)
    box.uncheck()
    assert (pixels(one) == before).all()
    one.keep("thousand-names")


def test_own_script_runs_and_an_injected_one_does_not(three: tuple[Path, Frames], open_page: Open) -> None:
    text = three[0].read_text(encoding="utf-8")
    evil = '<script>document.title = "broken in"</script><img src="data:," onerror="document.title = 1">'
    evil += '<p id="styled" style="color: rgb(1, 2, 3)">styled</p><style>#styled { top: 7px }</style>'
    broken = three[0].with_name("broken_in.html")
    broken.write_text(text.replace("<main>", f"<main>{evil}", 1), encoding="utf-8")
    one = open_page(broken)
    one.page.keyboard.press("ArrowRight")
    assert one.state()["frame"] == 1  # the player works
    assert one.page.locator("body").evaluate("node => getComputedStyle(node).maxWidth") == "1088px"
    assert one.page.title().startswith("three_blocks")
    look = one.page.locator("#styled").evaluate("node => [getComputedStyle(node).color, getComputedStyle(node).top]")
    assert look[0] != "rgb(1, 2, 3)"
    assert look[1] == "auto"
    assert len(one.complaints) == 4
    assert all("Content Security Policy" in text for text in one.complaints)
    one.complaints.clear()


def test_everything_that_acts_is_reached_by_tab_and_has_a_name(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    nameless = one.page.evaluate(
        """() => [...document.querySelectorAll("section:not([hidden]) :is(button, select, input, canvas, svg[role])")]
            .filter((node) => !node.getAttribute("aria-label") && !node.closest("label") && !node.textContent.trim())
            .map((node) => node.outerHTML)"""
    )
    assert nameless == []
    one.page.keyboard.press("Tab")
    assert one.page.evaluate("document.activeElement.tagName") == "CANVAS"
    one.page.keyboard.press("Tab")
    assert one.page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_block_under_the_mouse_tells_its_state(three: tuple[Path, Frames], open_page: Open) -> None:
    path, frames = three
    one = open_page(path)
    canvas = one.page.locator(".stage canvas").bounding_box()
    assert canvas is not None
    x, y = one.state()["centres"][2]
    one.page.mouse.move(canvas["x"] + x + 1, canvas["y"] + y + 1)
    told = one.page.locator(".player .state").inner_text()
    assert "block 3" in told
    assert f"x {1e3 * frames.x[0, 2]:.2f} mm" in told
    before = one.state()["centres"][2]
    one.page.mouse.down()
    one.page.mouse.move(canvas["x"] + x + 31, canvas["y"] + y + 1)
    one.page.mouse.up()
    assert one.state()["centres"][2][0] - before[0] == pytest.approx(30.0, abs=1.0)


def test_cursor_of_the_histories_follows_and_leads(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    cursor, over = one.page.locator(".histories .cursor"), one.page.locator(".histories .over")
    first = cursor.get_attribute("x1")
    one.page.keyboard.press("End")
    assert float(cursor.get_attribute("x1") or 0) > float(first or 0)
    box = over.bounding_box()
    assert box is not None
    middle = one.page.evaluate("blocksim.built.get('part-1').histories.across(0.1)")
    over.click(position={"x": float(middle) * box["width"], "y": 40})
    assert one.state()["frame"] == pytest.approx(10, abs=1)


def test_a_chosen_block_has_a_curve_in_the_panels_of_its_place_and_turn(
    three: tuple[Path, Frames], open_page: Open
) -> None:
    path, frames = three
    one = open_page(path)
    one.page.locator("[data-option=block]").select_option("2")
    drawn = one.page.locator(".histories .curve").get_attribute("d") or ""
    curves = [np.array([point.split(",") for point in part.split("L")], dtype=float) for part in drawn.split("M")[1:]]
    assert [len(curve) for curve in curves] == [21] * 3
    assert np.ptp(curves[0][:, 1]) > 0.01  # it goes its way along x
    assert np.corrcoef(curves[0][:, 1], frames.x[:, 2])[0, 1] == pytest.approx(-1.0, abs=1e-3)  # down on a screen
    one.page.locator("[data-option=block]").select_option("-1")
    assert not one.page.locator(".histories .curve").get_attribute("d")


MEASURED = (213, 94, 0)


def test_measured_ranges_stand_below_the_ground(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0])
    columns = np.nonzero(seen(one, MEASURED))[1]
    scale, (start, _) = one.state()["scale"], one.state()["centres"][0]
    ends = start + scale * (np.array([16.0, 136.05]) - 16.0)  # block 1 is measured at 16 mm, block 3 up to 136.05
    assert np.abs([columns.min() + 3.0 - ends[0], columns.max() - ends[1]]).max() < 2.0
    one.page.locator("[data-option=measured]").uncheck()
    assert not seen(one, MEASURED).any()


def test_sweep_is_sorted_filtered_and_its_members_open(swept: Path, open_page: Open) -> None:
    one = open_page(swept)
    rows = one.page.locator("table.cases tbody tr")
    assert rows.count() == 6
    head = one.page.get_by_role("button", name="1.x_mm")
    head.click()
    assert "66.00" in rows.first.inner_text()
    head.click()
    assert "70.00" in rows.first.inner_text()
    assert "failed" in rows.last.inner_text()  # without a number, last both ways
    one.keep("sweep")
    one.page.get_by_label("Filter").fill("overlap")
    assert rows.count() == 1
    one.page.get_by_label("Filter").fill("")
    one.page.locator("table.cases a").first.click()
    assert one.page.locator("section.subject:not([hidden])").get_attribute("data-kind") == "run"
    one.page.keyboard.press("End")
    assert one.state()["frame"] == 4
    one.page.get_by_role("link", name="Back to the sweep").click()
    one.page.locator(".map .picture").first.wait_for(state="visible")


def test_measured_range_is_marked_in_the_table(tmp_path: Path, open_page: Open) -> None:
    write_sweep(tmp_path / "sweep", kept=0)
    write_experiment(tmp_path / "repeats.csv")
    report(tmp_path / "sweep", "--experiment", tmp_path / "repeats.csv", "--out", tmp_path / "report.html")
    one = open_page(tmp_path / "report.html")
    assert one.page.locator("table.cases td.inside", has_text="69.00").count() == 1
    assert one.page.locator("table.cases td.outside", has_text="70.00").count() == 1


def test_what_is_not_stored_is_told_with_how_to_store_it(
    three: tuple[Path, Frames], swept: Path, open_page: Open
) -> None:
    one = open_page(three[0])
    assert one.page.get_by_label("contact forces").count() == 0
    assert "--set output.contacts=true" in one.page.locator(".player .notes").inner_text()
    one = open_page(swept)
    one.page.locator(".map .over").first.focus()
    for _ in range(6):
        one.page.keyboard.press("ArrowRight")
    told = one.page.locator(".map .state").inner_text()
    assert "case 000000000005" in told
    assert "--keep-cases" in told


@pytest.mark.parametrize("kind", ["three", "swept"])
@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("phone", {"viewport": {"width": 360, "height": 740}, "is_mobile": True, "has_touch": True}),
        ("dark", {"color_scheme": "dark"}),
    ],
)
def test_page_fits_phones_and_has_dark_colours(
    kind: str, name: str, options: dict[str, object], request: pytest.FixtureRequest, open_page: Open
) -> None:
    found = request.getfixturevalue(kind)
    one = open_page(found if isinstance(found, Path) else found[0], **options)
    assert one.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    back = one.page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (back == "rgb(255, 255, 255)") == (name != "dark")
    one.keep(f"{kind}-{name}")


def test_tables_and_pictures_wider_than_a_phone_say_that_they_scroll(tmp_path: Path, open_page: Open) -> None:
    write_run(tmp_path / "run", count=5)
    stored = read_folder(tmp_path / "run")
    study = StudyPage("study", "", [], "Title", ("head",), [("cell",)], picture=sheet_png())
    subjects = [study_subject("part-2", study, "study"), run_subject("part-1", stored)]
    write_report(subjects, tmp_path / "report.html")
    phone = {"viewport": {"width": 390, "height": 740}, "is_mobile": True, "has_touch": True}
    hint = "(node) => [node.scrollWidth > node.clientWidth, getComputedStyle(node, '::before').content !== 'none']"
    for options, expected in ((phone, True), ({}, False)):
        for part in ("#part-1", "#part-2"):
            one = open_page(tmp_path / "report.html", part, **options)
            boxes = one.page.locator("section:not([hidden]) .wide")
            boxes.first.wait_for()
            one.page.wait_for_timeout(100)
            found = [box.evaluate(hint) for box in boxes.all()]
            assert [wide == told for wide, told in found] == [True] * len(found)
            assert found[0] == [expected, expected]
            assert one.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
            one.keep(f"wide-{part[1:]}-{expected}")


def sheet_png() -> bytes:
    """Return a picture of the size of those of studies."""
    file = io.BytesIO()
    Image.new("RGB", (1080, 640), "white").save(file, "PNG")
    return file.getvalue()


def test_paper_is_white_and_has_no_controls(three: tuple[Path, Frames], open_page: Open) -> None:
    one = open_page(three[0], color_scheme="dark")
    one.page.emulate_media(media="print")
    assert one.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not one.page.get_by_role("button", name="Play").is_visible()
    corner = pixels(one)[3, 3]
    assert corner.tolist() == [255, 255, 255]
    one.keep("three-print")


def test_forces_are_shown_on_request_and_where_the_contacts_are(tmp_path: Path, open_page: Open) -> None:
    one = open_page(reported(tmp_path, count=5, overrides={"output.contacts": True})[0])
    one.page.evaluate(f"{PLAYER}.toggle('names')")
    one.page.evaluate(f"{PLAYER}.show(4)")
    before = pixels(one)
    one.page.keyboard.press("f")
    assert one.page.get_by_label("contact forces").is_checked()
    changed = (pixels(one) != before).any(axis=-1)
    scale, centres = one.state()["scale"], np.array(one.state()["centres"])
    columns = np.nonzero(changed.any(axis=0))[0]
    for x, _ in centres:  # made-up contacts are below the centres
        assert np.abs(columns - x).min() <= 1.0
    assert all(np.abs(centres[:, 0] - column).min() < 8.0 for column in columns)
    assert np.nonzero(changed.any(axis=1))[0].size == pytest.approx(0.6 * 41.0 * scale, abs=6.0)
    assert "Arrows: contact forces" in one.page.locator(".player .notes").inner_text()
    one.keep("three-blocks-forces")
