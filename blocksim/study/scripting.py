"""Studies as a Python script asks for them: scenarios and plain values in, results out.

The commands of the same name build on the same functions; here are the defaults that a script expects.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.scenario import Source, document_of
from blocksim.study.calibrate import calibrate as calibration
from blocksim.study.calibrate.plan import read_plan
from blocksim.study.plan import Values
from blocksim.study.sensitivity import sensitivity as analysis
from blocksim.study.sensitivity.methods import METHODS
from blocksim.study.variation import Variations, varied

NOTHING = "nothing to vary: give vary={key: {'from': a, 'to': b}}, or a [sweep] table with distributions"


def calibrate(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    fit: Mapping[str, Values],
    scatter: Mapping[str, Values] | None = None,
    *,
    experiment: Path | str | None = None,
    trials: int = calibration.TRIALS,
    members: int = calibration.MEMBERS,
    fresh_members: int = calibration.FRESH_MEMBERS,
    seed: int = 0,
    out: Path | str | None = None,
    resume: bool = False,
    overwrite: bool = False,
) -> calibration.Fit:
    """Fit inputs to measured repeats so that agreement is probable under the scatter of the other inputs.

    `fit` gives the priors by dotted key, {"contact.restitution": {"from": 0.2, "to": 0.35}}, `scatter` distributions
    ({"mean": m, "sd": s} or {"from": a, "to": b}; default: those of the [sweep] table). Writes a scenario with the
    fitted values and their provenance to `out` (default: results/NAME/calibrate-HASH/scenario.toml) and returns the
    fit. Raises ScenarioError, InputMissingError without an experiment table, InvalidInputError, OutputExistsError,
    UnavailableError without the extra `study`, StoppedEarlyError on Ctrl-C (`resume` continues).
    """
    plan = read_plan(
        document_of(scenario),
        Variations.of(fit),
        None if scatter is None else Variations.of(scatter),
        experiment=None if experiment is None else Path(experiment),
        members=members,
        seed=seed,
    )
    return calibration.calibrate(
        plan,
        trials=trials,
        fresh_members=fresh_members,
        out=None if out is None else Path(out),
        resume=resume,
        overwrite=overwrite,
        on_trial=lambda *_: None,
    )


def sensitivity(
    scenario: Source,
    vary: Mapping[str, Values] | None = None,
    *,
    method: str = "morris",
    samples: int | None = None,
    seed: int = 0,
) -> analysis.Sensitivity:
    """Return Morris (`method="morris"`) or Sobol (`"sobol"`) indices of the run-outs and of the outcome.

    `vary` gives a distribution by dotted key, {"gravity": {"from": 9.7, "to": 9.9}} (default: those of the [sweep]
    table). `samples` is the number of trajectories or base samples. Raises ScenarioError, InvalidInputError where
    nothing is varied or the method is unknown, UnavailableError without the extra `study`, TooManyFailuresError.
    """
    if method not in METHODS:
        message = f"unknown method {method!r}; choose one of {', '.join(METHODS)}"
        raise InvalidInputError(message)
    document = document_of(scenario)
    plan = varied(document, Variations.of(vary), "vary", "sobol") if vary else document.build().sweep
    if plan is None or not plan.is_sampled:
        raise InvalidInputError(NOTHING)
    bare = replace(document, data={key: value for key, value in document.data.items() if key != "sweep"})
    return analysis.sensitivity(bare, plan, METHODS[method], samples=samples, seed=seed)
