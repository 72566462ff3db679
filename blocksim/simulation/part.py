"""One part of a run that is kept in a folder: from its start or a checkpoint to its end or an interruption."""

from pathlib import Path

from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint import restored
from blocksim.simulation.checkpoint_origin import origin_of
from blocksim.simulation.checkpoint_writer import NO_PAST, CheckpointWriter, Past
from blocksim.simulation.loop import Attendance, LoopResult, run_loop
from blocksim.simulation.precautions import Precautions
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.resumption import Resumption, check_frames, kept_rows
from blocksim.simulation.schemes import AnyScene, scheme_named
from blocksim.simulation.stores.hdf5_writer import FrameFile
from blocksim.simulation.summary import Summary
from blocksim.simulation.team import Team


class Part:
    """What goes into the folder of a run while it runs: frames and checkpoints."""

    def __init__(self, scenario: Scenario, folder: Path, built: AnyScene, resumption: Resumption) -> None:
        """Take the scene at time zero and go to the checkpoint, if there is one.

        Nothing is written yet. Raises InvalidInputError where the checkpoint or the frames before it do not fit.
        """
        self.scenario, self.folder, self.resumption = scenario, folder, resumption
        self.placed = place_bodies(scenario)
        stored = resumption.checkpoint
        self.scene = built if stored is None else restored(stored, built)
        self.step = float(self.scene.world.controls[0].step)
        self.recorder = Recorder(self.placed, scenario.output.every, self.step, contacts=scenario.output.contacts)
        self.past = NO_PAST
        if stored is not None:
            self.past = Past.of(stored.path, stored.position)
            self.recorder.take_over(kept_rows(folder, scenario, self.recorder))
            check_frames(stored, self.recorder)

    def run(self, toml: str, precautions: Precautions, team: Team, attendance: Attendance) -> LoopResult:
        """Run to the end or an interruption; the file of the frames says `toml`. Raises OutputError."""
        path, names, kept = self.folder / files.FRAMES, scheme_named(self.scenario).ledger, self.recorder.held
        contacts = self.scenario.output.contacts
        with FrameFile(path, self.placed, self.step, toml, ledger=names, kept=kept, contacts=contacts) as sink:
            self.recorder.pour_into(sink)
            files.clear_remains(self.folder, (files.FINAL, files.SUMMARY))  # they tell of the part before
            self.writer = self._writer(sink, precautions)
            watched = Attendance(attendance.on_progress, attendance.stop, self.writer)
            since = self.resumption.checkpoint and self.resumption.checkpoint.position
            return run_loop(
                self.scene, self.recorder, self.scenario.time.end, team=team, attendance=watched, since=since
            )

    @property
    def goes_on(self) -> bool:
        """Return True if there is a part before this one."""
        return self.resumption.checkpoint is not None

    def account(self, summary: Summary) -> Summary:
        """Return the summary of this part as that of the whole run."""
        last = None if summary.status == "finished" else self.writer.last_step
        return summary.model_copy(
            update={
                "total_seconds": self.past.seconds + summary.total_seconds,
                "resumed_from": self.past.resumed_from,
                "last_checkpoint": last,
                "warnings": (*self.resumption.remarks, *self._altered(), *summary.warnings),
            }
        )

    def _altered(self) -> tuple[str, ...]:
        """Return what to tell of frames after the checkpoint that have come out otherwise now."""
        steps = self.recorder.altered
        if not steps:
            return ()
        more = f" and {len(steps) - 1} more" if len(steps) > 1 else ""
        where = f"{self.folder / files.FRAMES}: the frame of step {steps[0]}{more}"
        return (f"{where} is not what comes out now: changed since it was recorded",)

    def _writer(self, sink: FrameFile, precautions: Precautions) -> CheckpointWriter:
        return CheckpointWriter(
            self.folder,
            origin_of(self.scenario),
            sink,
            precautions.periods(self.step),
            precautions.checkpoint_seconds,
            self.past,
        )
