"""blocksim export: all frames of a run for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.output import note, replacement
from blocksim.errors import OutputExistsError
from blocksim.simulation import folder as files
from blocksim.simulation.own_files import refuse_foreign
from blocksim.simulation.stores.formats import format_named
from blocksim.study.stored_run import stored_run


def export_command(
    run: options.StoredRunPath,
    kind: Annotated[
        str,
        typer.Option("--format", metavar="FORMAT", help="csv, vtkhdf for ParaView, geojson or dxf."),
    ] = "csv",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write (default: NAME.csv, NAME.vtkhdf).")
    ] = None,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Write all frames as CSV or VTKHDF, or final outlines as GeoJSON or DXF.

    CSV: a row for each frame and block, with units in the heads; stored contacts go into a second file,
    NAME_contacts.csv. VTKHDF: one file with all times, blocks with number, velocity and rotation,
    ground and walls with number 0; ParaView opens it. GeoJSON and DXF: the outlines of all blocks in the last frame, in
    m, which can be re-imported as `polygons`; blocks at rest overlap by the contact deformation, so set `shrink`,
    such as "0.01 mm". A run that was stopped or killed is written as far as it got.

    An older export is replaced; any other file only with --overwrite.

    Example: blocksim export scenarios/three_blocks.toml --format vtkhdf
    """
    form = format_named(kind)
    stored = stored_run(run)
    file = out or Path(f"{stored.scenario.name}.{kind}")
    beside = file.with_name(f"{file.stem}_contacts{file.suffix}")
    _refuse_own_files(file, stored.folder)
    refuse_foreign(file, overwrite=overwrite)
    if form.write_contacts is not None and stored.frames.contacts is not None:
        refuse_foreign(beside, overwrite=overwrite)
    told = [f"file: {file} ({replacement(file)}{form.write(file, stored.frames, stored.scenario)} {form.counted})"]
    if form.write_contacts is not None and stored.frames.contacts is not None:
        older = replacement(beside)
        count = form.write_contacts(beside, stored.frames, stored.frames.contacts)
        told.append(f"file: {beside} ({older}{count} contacts)")
    if stored.remark:
        note(stored.remark)
    if not quiet:
        note("\n".join(told))


def _refuse_own_files(file: Path, folder: Path) -> None:
    """Raise OutputExistsError for a file of the run itself."""
    if file.name in files.OURS and file.resolve().parent == folder.resolve():
        message = f"{file}: belongs to the run; choose another name with --out"
        raise OutputExistsError(message)
