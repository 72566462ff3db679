"""blocksim plot, animate, report, export: what is stored as pictures, a film, a page, and files for other programs."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from blocksim.cli import command_line, output, progress
from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.options import Option, Replace, silent
from blocksim.simulation import files
from blocksim.simulation.stores.exports import FORMATS
from blocksim.study import compare, pictures, report, run_folder
from blocksim.view import style

style.are_docstrings_read = False
MEGABYTE = 1e6
RunPath = Annotated[
    Path,
    Option("Run folder, results/NAME (its newest finished run) or scenario file.", metavar="RUN", is_argument=True),
]


def plot_command(
    run: Annotated[
        Path,
        Option(
            "Run folder, results/NAME, scenario file, folder of a sweep or study, table of sensitivities.",
            metavar="RUN",
            is_argument=True,
        ),
    ],
    options: pictures.PlotOptions,
) -> command_line.Report:
    """Draw a run, a sweep or a table of sensitivities.

    The strip shows the measured ranges below the final state. --kind final shows the final positions, with rotation
    and measured range below each of them; --kind history shows x, y, rotation, energies, contacts and the ground's
    motion over time, or the panels of --panels; --kind motion shows acceleration, velocity and displacement of the
    supports with their peaks, also of a scenario that has not been run; --kind probe shows what [[probes]] recorded;
    --kind profile shows the surface of soil at several times.
    --forces draws contact forces as arrows, of runs that have stored them (output.contacts = true). A run that was
    stopped or killed is drawn as far as it got.

    A sweep over one key, or a second one with few values, is drawn as lines of final x; over two keys as a map of
    run-outs and outcomes; a sampled one as a matrix of its inputs. The measured range is marked in all of them. A
    fragility study is drawn as its counts, with limits, and the curve with its band; a limit as the mechanism beside
    its last stable neighbour; limits over another key as a curve, beside those of a table that --experiment names
    (columns over, limit and series, with units as in limits.csv).

    An older picture of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    picture, remark = pictures.draw(run, options)
    return command_line.Report(notes=[f"picture: {picture}"], always=[remark] if remark else [])


def animate_command(
    run: RunPath,
    options: pictures.AnimateOptions,
    screen: command_line.TextScreen,
    *,
    live: Annotated[
        bool,
        Option("Show the run on a page of the loopback address instead, until Ctrl-C; it follows one in progress."),
    ] = False,
) -> command_line.Report:
    """Render a run as an animation, GIF or MP4.

    The default is a GIF, NAME.gif, at a quarter of the real speed; the last frame is held. A run that was
    stopped or killed is shown as far as it got. --forces needs a run that has stored contacts (output.contacts =
    true), MP4 the extra `video` or the system's ffmpeg. The view is fitted to the blocks; a few that travel far may
    leave it. An older animation of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim animate scenarios/three_blocks.toml --speed 0.1
    """
    if live:
        from blocksim.study.live import serve

        serve(run_folder.find_run(run, needed=(files.SCENARIO,)), lambda address: output.note(f"live: {address}"))
        return command_line.Report()
    with progress.count_progress("frames", quiet=screen.quiet) as on_picture:
        path, what, remark = pictures.draw_film(run, replace(options, on_picture=on_picture))
    return command_line.Report(notes=[f"animation: {path} ({what})"], always=[remark] if remark else [])


def report_command(
    places: Annotated[
        list[Path],
        Option(
            "Run folder, results/NAME, scenario file, folder of a sweep or study; one or several.",
            metavar="RUN",
            is_argument=True,
        ),
    ],
    *,
    out: Annotated[Path, Option("File to write.", metavar="FILE")] = Path("report.html"),
    experiment: compare.ExperimentTablePath = None,
    members: Annotated[
        int,
        Option("Maximum number of runs of a sweep in the page.", flags=("--runs", "--members"), metavar="N", least=0),
    ] = report.MEMBERS,
    overwrite: Replace = False,
    screen: command_line.TextScreen,
) -> command_line.Report:
    """Write runs and sweeps into one HTML file.

    It has a player, time histories, the comparison with measured repeats, energies and provenance; for a sweep the
    share of members inside, a table, a map and, with --keep-cases, the samples. The file is self-contained and can be
    opened from disk or sent by mail. Frames are thinned and rounded where they are many; the page says so. A run that
    was killed or damaged is shown as far as it can be read (exit code 65 for damage). An older report is replaced; any
    other file only with --overwrite.

    Example: blocksim report scenarios/three_blocks.toml --out three_blocks.html
    """
    files.refuse_foreign(out, overwrite=overwrite)
    table = None if experiment is None else Path(experiment)
    size, problems = report.report_on(places, out, table, members, silent if screen.quiet else output.note)
    screen.note(f"report: {out} ({size / MEGABYTE:.1f} MB)")
    if problems:
        raise InvalidInputError("\n".join([*problems, "the report shows everything else"]))
    return command_line.Report()


def export_command(
    run: RunPath,
    *,
    kind: Annotated[
        str, Option("csv, vtkhdf for ParaView, geojson or dxf.", flags=("--format",), metavar="FORMAT")
    ] = "csv",
    out: Annotated[Path | None, Option("File to write (default: NAME.csv, NAME.vtkhdf).", metavar="FILE")] = None,
    overwrite: Replace = False,
) -> command_line.Report:
    """Write all frames as CSV or VTKHDF, or final outlines as GeoJSON or DXF.

    CSV: a row for each frame and block, with units in the heads. VTKHDF: one file with all times, blocks with number,
    name, velocity and rotation, ground and walls with number 0; ParaView opens it. Stored contacts and their forces go
    into a second file, NAME_contacts.csv or NAME_contacts.vtkhdf. GeoJSON and DXF: the outlines of all blocks in the
    last frame, in m, which can be re-imported as `polygons`; blocks at rest overlap by the contact deformation, so set
    `shrink`, such as "0.01 mm". A run that was stopped or killed is written as far as it got.

    An older export is replaced; any other file only with --overwrite.

    Example: blocksim export scenarios/three_blocks.toml --format vtkhdf
    """
    if kind not in FORMATS:
        raise InvalidInputError(f"--format {kind}: unsupported format; use {' or '.join(FORMATS)}")
    form = FORMATS[kind]
    stored = run_folder.read_run(run)
    contacts = stored.frames.contacts
    file = out or Path(f"{stored.model.scenario.name}.{kind}")
    beside = file.with_name(f"{file.stem}_contacts{file.suffix}")
    if file.name in files.OURS and file.resolve().parent == stored.folder.resolve():
        raise OutputExistsError(f"{file}: belongs to the run; choose another name with --out")
    files.refuse_foreign(file, overwrite=overwrite)
    if form.write_contacts is not None and contacts is not None:
        files.refuse_foreign(beside, overwrite=overwrite)
    older = pictures.OLDER if file.exists() else ""
    notes = [f"file: {file} ({older}{form.write(file, stored.frames, stored.model)} {form.counted})"]
    if form.write_contacts is not None and contacts is not None:
        older = pictures.OLDER if beside.exists() else ""
        notes.append(f"file: {beside} ({older}{form.write_contacts(beside, stored.frames, contacts)} contacts)")
    return command_line.Report(notes=notes, always=[stored.remark] if stored.remark else [])
