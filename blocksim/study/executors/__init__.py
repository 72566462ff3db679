"""What runs the cases of a sweep. A new executor is one module with `check` and `run_tasks`, and one line here."""

from importlib import import_module

from blocksim.errors import InvalidInputError
from blocksim.scenario.findings import did_you_mean_or_list
from blocksim.study.executors.task import Executor

EXECUTORS = {
    "ensemble": "blocksim.study.executors.ensemble",
    "processes": "blocksim.study.executors.processes",
    "dask": "blocksim.study.executors.dask",
}
DEFAULT = "ensemble"
WITH_FOLDERS = "processes"
WITH_SCHEDULER = "dask"


def executor_named(name: str) -> Executor:
    """Return an executor. Raises InvalidInputError."""
    if name not in EXECUTORS:
        message = f"there is no executor '{name}', {did_you_mean_or_list(name, EXECUTORS)}"
        raise InvalidInputError(message)
    module = import_module(EXECUTORS[name])
    return Executor(module.run_tasks, module.check)
