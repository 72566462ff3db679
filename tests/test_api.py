"""What a script or a notebook gets from `import blocksim`, and the exit code of each sort of error."""

import doctest
import inspect
import pydoc
import re
import struct
import tomllib
from pathlib import Path

import numpy as np
import pytest

import blocksim
from blocksim import errors
from blocksim.cli.commands import load_command
from blocksim.errors import InvalidInputError, ScenarioError
from blocksim.options import option_fields
from blocksim.simulation import Result
from blocksim.study.calibrate_plan import CalibrateOptions
from blocksim.study.pictures import AnimateOptions, PlotOptions
from blocksim.study.run import RunOptions
from blocksim.study.sensitivity import SensitivityOptions
from blocksim.study.sweep import SweepOptions

ROOT = Path(__file__).parent.parent
SLIDE = ROOT / "scenarios" / "slide.toml"
SOFT = {"contact.stiffness_scale": 0.001}


@pytest.fixture(scope="module")
def slide() -> Result:
    return blocksim.run(blocksim.load(SLIDE, SOFT))


def test_example_of_the_package_prints_what_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert doctest.testmod(blocksim) == (0, 4)


@pytest.mark.parametrize("name", blocksim.__all__)
def test_example_of_a_function_prints_what_it_says(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    public = {one: getattr(blocksim, one) for one in blocksim.__all__}
    (example,) = doctest.DocTestFinder(recurse=False).find(public[name], name, module=False, globs=public)
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0, capsys.readouterr().out


def test_help_lists_every_public_function() -> None:
    text = pydoc.plain(pydoc.render_doc(blocksim))
    forms = ("    {}(", "    {} = ", "    class {}(")
    assert [name for name in blocksim.__all__ if not any(form.format(name) in text for form in forms)] == []


def test_completion_of_the_package_offers_the_functions_for_users_alone() -> None:
    assert dir(blocksim) == sorted([*blocksim.__all__, "__version__"])


@pytest.mark.parametrize("name", blocksim.__all__)
def test_defaults_in_help_are_readable(name: str) -> None:
    shown = str(inspect.signature(getattr(blocksim, name)))
    assert not re.search(r"lambda|0x[0-9a-f]+", shown), shown


OPTIONS = {
    "run": RunOptions,
    "sweep": SweepOptions,
    "calibrate": CalibrateOptions,
    "sensitivity": SensitivityOptions,
    "plot": PlotOptions,
    "animate": AnimateOptions,
}


@pytest.mark.parametrize("name", OPTIONS)
def test_a_function_takes_the_options_of_its_command_with_the_same_help(name: str) -> None:
    function, command = getattr(blocksim, name), load_command(name)
    texts = {param.name: param.help for param in command.params}
    names = list(inspect.signature(function).parameters)
    for field in option_fields(OPTIONS[name]):
        assert field.name in names
        if field.option is not None:
            assert texts[field.name] == field.option.help
            assert f"    {field.name}: " in function.__doc__


def test_options_are_given_one_by_one_or_at_once(tmp_path: Path) -> None:
    one = blocksim.sweep(SLIDE, {"gravity": [9.7, 9.8]}, out=tmp_path / "one", jobs=1)
    other = blocksim.sweep(SLIDE, SweepOptions({"gravity": [9.7, 9.8]}, out=tmp_path / "other", jobs=1))
    assert one.table.drop(columns="seconds", errors="ignore").equals(
        other.table.drop(columns="seconds", errors="ignore")
    )
    with pytest.raises(TypeError, match="unexpected keyword argument 'mood'"):
        blocksim.sweep(SLIDE, mood="grid")  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="missing a required argument: 'scenario'"):
        blocksim.sweep()  # type: ignore[call-overload]


@pytest.mark.parametrize("scenario", ["slide", "record_column", "tilting_arch"])
def test_a_scenario_shows_in_a_notebook_with_its_blocks_and_all_values(scenario: str) -> None:
    loaded = blocksim.load(ROOT / f"scenarios/{scenario}.toml")
    html = loaded._repr_html_()
    assert html.startswith(f"<p>Scenario {loaded.name}: ")
    assert f"<td>{next(iter(loaded.blocks))}</td>" in html
    assert "[contact]" in html


def test_a_comparison_shows_in_a_notebook_as_its_table(slide: Result, tmp_path: Path) -> None:
    block = slide.columns["block"][0]
    (tmp_path / "a<b>.csv").write_text(f"block,quantity,unit,replicate,value\n{block},x,mm,1,41\n{block},x,mm,2,43\n")
    html = blocksim.compare(slide, tmp_path / "a<b>.csv")._repr_html_()
    assert "a&lt;b&gt;.csv" in html
    assert "<b>" not in html
    assert "<th>verdict</th>" in html
    folder = blocksim.sweep(SLIDE, {"gravity": [9.8, 9.9]}, out=tmp_path / "sweep", jobs=1)
    assert "samples inside all ranges" in blocksim.compare(folder, tmp_path / "a<b>.csv")._repr_html_()


def test_a_scenario_from_dictionaries_is_that_of_the_file() -> None:
    data = tomllib.loads(SLIDE.read_text(encoding="utf-8"))
    assert blocksim.load(data) == blocksim.load(SLIDE)


def test_replace_validates_like_a_file_and_leaves_the_scenario_alone() -> None:
    flat = blocksim.load(SLIDE)
    tilted = blocksim.replace(flat, {"ground.tilt": "5 deg"})
    assert flat.ground.tilt == 0.0
    assert tilted.ground.tilt == pytest.approx(np.radians(5.0))
    with pytest.raises(ScenarioError, match=r"ground.tlt: unknown key, did you mean 'tilt'"):
        blocksim.replace(flat, {"ground.tlt": "5 deg"})


def test_replace_keeps_the_experiment_table_of_a_scenario() -> None:
    path = ROOT / "scenarios" / "three_blocks.toml"
    changed = blocksim.replace(blocksim.load(path), {"contact.restitution": 0.1})
    assert changed.experiment == blocksim.load(path).experiment


def test_trajectories_are_a_tidy_table(slide: Result) -> None:
    table = slide.to_frame()
    assert len(table) == len(slide.frames) * 1
    assert table.iloc[-1]["x_mm"] == pytest.approx(slide.final["x_mm"][0], abs=1e-12)
    assert table["vx_mm_s"].iloc[0] == pytest.approx(500.0)


def test_trajectories_of_several_blocks_keep_their_names() -> None:
    result = blocksim.run(blocksim.load(ROOT / "scenarios" / "three_blocks.toml", {**SOFT, "time.end": 0.01}))
    table = result.to_frame()
    assert list(table["block"][:4]) == ["1", "2", "3", "1"]
    last = table[table["time_s"] == table["time_s"].max()]
    np.testing.assert_array_equal(last["y_mm"], result.final["y_mm"])


def test_trajectories_as_a_data_set_carry_units(slide: Result) -> None:
    data = slide.to_xarray()
    assert dict(data.sizes) == {"time": len(slide.frames), "block": 1}
    assert data["x"].attrs["units"] == "m"
    assert float(data["x"].sel(block="block").isel(time=-1)) == slide.frames.x[-1, 0]
    assert "energy_kinetic" in data


def test_results_and_scenarios_show_as_one_line(slide: Result) -> None:
    assert repr(slide).startswith("<Result slide: finished (at rest), 1 block, 0.18")
    assert repr(slide.scenario) == "<Scenario slide: 1 single body; scheme explicit>"
    assert "<table" in slide._repr_html_()


def test_stored_runs_and_sweeps_open_again(tmp_path: Path) -> None:
    kept = blocksim.run(blocksim.load(SLIDE, SOFT), out=tmp_path / "run")
    assert blocksim.open_run(tmp_path / "run").final.equals(kept.final)
    swept = blocksim.sweep(blocksim.load(SLIDE, SOFT), {"gravity": [9.7, 9.8]}, out=tmp_path / "sweep", jobs=1)
    assert blocksim.open_sweep(tmp_path / "sweep").table.equals(swept.table)
    assert repr(swept).endswith("2 cases; varied: gravity>")


def test_pictures_animations_and_reports_are_made_of_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    kept = blocksim.run(blocksim.load(SLIDE, {**SOFT, "time.end": 0.02}), out="kept")
    assert blocksim.plot(kept, frames=3, size=(127.0, 101.6), dpi=100.0).name == "slide.png"
    assert struct.unpack(">II", Path("slide.png").read_bytes()[16:24]) == (500, 400)
    assert blocksim.plot("kept", "h.svg", kind="history", panels=["x"]).stat().st_size > 0
    assert blocksim.animate(kept, width=200, fps=5.0).name == "slide.gif"
    assert "slide" in blocksim.report(kept).read_text(encoding="utf-8")
    with pytest.raises(InvalidInputError, match="unknown colour 'red' in this run; choose block, material, sp"):
        blocksim.plot(kept, colour="red", overwrite=True)
    with pytest.raises(InvalidInputError, match="unknown method 'moris'"):
        blocksim.sensitivity(SLIDE, method="moris")


def test_picture_of_a_result_that_was_not_kept_says_what_to_do(slide: Result) -> None:
    with pytest.raises(InvalidInputError, match="run it with out=FOLDER"):
        blocksim.plot(slide)


CODES = {
    errors.BlocksimError: 70,
    errors.InvalidInputError: 65,
    errors.ScenarioError: 65,
    errors.InputMissingError: 66,
    errors.UnavailableError: 69,
    errors.OutputExistsError: 73,
    errors.OutputError: 74,
    errors.StoppedEarlyError: 75,
}


@pytest.mark.parametrize(("error", "code"), CODES.items(), ids=lambda one: getattr(one, "__name__", one))
def test_every_sort_of_error_has_its_exit_code(error: type[errors.BlocksimError], code: int) -> None:
    assert error.exit_code == code


def test_no_sort_of_error_is_forgotten_here() -> None:
    here = {one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, errors.BlocksimError)}
    assert here == set(CODES)
