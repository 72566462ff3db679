"""Notebooks: results show themselves, draw themselves in memory, and the notebooks that ship run from end to end."""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

import blocksim
from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.simulation import Result

ROOT = Path(__file__).parent.parent
BLOCKS = ROOT / "scenarios" / "three_blocks.toml"
SOFT = {"contact.stiffness_scale": 0.001, "time.end": 0.01}
PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def blocks() -> Result:
    return blocksim.run(blocksim.load(BLOCKS, SOFT))


def images(html: str) -> list[str]:
    """Return the kinds of pictures in a text for notebooks."""
    return re.findall(r'<img src="data:image/(\w+);base64,', html)


def test_a_picture_in_memory_is_the_one_that_plot_writes(tmp_path: Path) -> None:
    kept = blocksim.run(blocksim.load(BLOCKS, SOFT), out=tmp_path / "run")
    for kind, suffix in (("strip", ".png"), ("final", ".svg"), ("history", ".png")):
        written = blocksim.plot(kept, tmp_path / f"plot{suffix}", kind=kind, overwrite=True)
        assert kept.plot(kind).save(tmp_path / f"own{suffix}", overwrite=True).read_bytes() == written.read_bytes()


def test_a_figure_can_be_changed_before_it_is_shown(blocks: Result) -> None:
    picture = blocks.plot(size=(160.0, 120.0), dpi=80.0)
    before = picture._repr_png_()
    picture.figure.axes[0].set_title("mine")
    assert before is not None
    assert before[:4] == PNG
    assert before != picture._repr_png_()


def test_what_is_in_memory_draws_without_files(blocks: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "three_blocks.png").write_text("mine")
    assert images(blocks._repr_html_()) == ["png"]
    film = blocks.animate(width=200, fps=5.0)
    assert (images(film._repr_html_()), film.figure) == (["gif"], None)
    assert blocks.report()._repr_html_().startswith('<iframe sandbox="allow-scripts" srcdoc=')
    assert [path.name for path in tmp_path.iterdir()] == ["three_blocks.png"]


def test_displays_are_saved_in_the_format_of_the_suffix(blocks: Result, tmp_path: Path) -> None:
    film, page = blocks.animate(width=200, fps=5.0), blocks.report()
    assert film.save(tmp_path / "film.gif").read_bytes()[:3] == b"GIF"
    assert 'content="blocksim report"' in page.save(tmp_path / "page.html").read_text(encoding="utf-8")
    with pytest.raises(InvalidInputError, match="unsupported"):
        page.save(tmp_path / "page.txt")
    with pytest.raises(InvalidInputError, match="unsupported"):
        film.save(tmp_path / "film.avi")
    (tmp_path / "other.png").write_text("mine")
    with pytest.raises(OutputExistsError):
        blocks.plot().save(tmp_path / "other.png")
    assert blocks.plot().save(tmp_path / "other.png", overwrite=True).read_bytes()[:4] == PNG


def test_a_scenario_shows_its_start_with_soil_and_its_motion() -> None:
    assert images(blocksim.load(ROOT / "scenarios/soil/vertical_cut.toml")._repr_html_()) == ["png"]
    pulse = blocksim.load(ROOT / "scenarios/pulse.toml")
    assert pulse.plot("motion").figure is not None
    with pytest.raises(InvalidInputError, match="run it for others"):
        pulse.plot("strip")
    with pytest.raises(InvalidInputError, match="pulse is in memory only"):
        blocksim.plot(pulse)  # type: ignore[call-overload]
    with pytest.raises(InvalidInputError, match="run the scenario first"):
        pulse.report()


def test_a_comparison_shows_the_end_of_its_run(blocks: Result, tmp_path: Path) -> None:
    assert images(blocksim.compare(blocks)._repr_html_()) == ["png"]
    blocksim.run(blocksim.load(BLOCKS, SOFT), out=tmp_path / "run")
    assert images(blocksim.compare(tmp_path / "run")._repr_html_()) == ["png"]
    assert images(blocksim.compare(blocks.final, blocks.experiment)._repr_html_()) == []


def test_sweeps_and_answers_of_studies_show_their_table_and_picture(tmp_path: Path) -> None:
    slide = blocksim.load(ROOT / "scenarios/slide.toml", {"contact.stiffness_scale": 0.001})
    swept = blocksim.sweep(slide, {"gravity": [9.7, 9.8]}, out=tmp_path / "sweep", jobs=1)
    table = tmp_path / "slide.csv"
    table.write_text("block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n")
    tilts, stands = {"ground.tilt": {"from": "0 deg", "to": "30 deg"}}, "moved < 60 mm"
    at_rest = blocksim.load(
        ROOT / "scenarios/slide.toml", {"contact.stiffness_scale": 0.001, "bodies.0.velocity": [0, 0]}
    )
    found = blocksim.limit(at_rest, tilts, stands=stands, tolerance=0.1, out=tmp_path / "limit", jobs=1)
    for shown in (swept, blocksim.compare(swept, table), found):
        html = shown._repr_html_()
        assert "<table" in html
        assert images(html) == ["png"]
        assert "srcdoc=" in shown.report()._repr_html_()


def test_sensitivity_convergence_and_calibration_show_their_table_and_picture(tmp_path: Path) -> None:
    slide = blocksim.load(ROOT / "scenarios/slide.toml", {"contact.stiffness_scale": 0.001})
    vary = {"friction.block_ground": {"from": 0.3, "to": 0.4}}
    table = tmp_path / "slide.csv"
    table.write_text("block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n")
    fitted = blocksim.calibrate(slide, vary, trials=4, members=1, experiment=table, out=tmp_path / "fitted.toml")
    ranked = blocksim.sensitivity(slide, vary, samples=4)
    refined = blocksim.converge(slide, studies=["step"], levels=2, out=tmp_path / "converge")
    for shown, kind in ((fitted, "trials"), (ranked, "tornado"), (refined, "levels")):
        html = shown._repr_html_()
        assert html.count("<td>") >= 3
        assert images(html) == ["png"]
        written = blocksim.plot(shown, tmp_path / f"{kind}.png", kind=kind)
        assert shown.plot(kind).save(tmp_path / "own.png", overwrite=True).read_bytes() == written.read_bytes()
        assert "srcdoc=" in shown.report()._repr_html_()
        with pytest.raises(InvalidInputError, match=f"drawn as '{kind}', not as 'strip'"):
            shown.plot("strip")
        with pytest.raises(InvalidInputError, match="no motion"):
            shown.animate()
    assert repr(fitted).startswith("<Fit of slide: best of 4 trials")
    assert set(ranked.to_frame()["key"]) == {*vary}


@pytest.mark.parametrize("name", sorted(path.name for path in (ROOT / "scenarios/notebooks").glob("*.ipynb")))
def test_a_notebook_that_ships_runs_and_shows_pictures(name: str, tmp_path: Path) -> None:
    client = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    shutil.copytree(ROOT / "scenarios", tmp_path / "scenarios", ignore=shutil.ignore_patterns("results"))
    path = tmp_path / "scenarios/notebooks" / name
    notebook: Any = nbformat.read(path, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # kept without, so that differences are readable
    resources = {"metadata": {"path": str(path.parent)}}
    client.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    shown = [text for cell in notebook.cells for one in cell.get("outputs", ()) for text in one.get("data", ())]
    assert shown.count("text/html") >= 5 or {"text/html", "image/png"} <= {*shown}  # of results, or a figure of its own
