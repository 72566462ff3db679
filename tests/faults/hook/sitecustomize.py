"""Puts one fault into one module while it is imported, in this process and in all that it starts.

Python imports a module of this name at its start, from PYTHONPATH. The file on the disk stays as it is, and so do its
compiled copies; the fault (file, text, replacement) comes as JSON in BLOCKSIM_FAULT.
"""

import importlib.abc
import importlib.machinery
import json
import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import CodeType, ModuleType


class _Faulty(importlib.machinery.SourceFileLoader):
    """Loads a module with one text replaced."""

    def __init__(self, name: str, path: str, fault: dict[str, str]) -> None:
        super().__init__(name, path)
        self.fault = fault

    def get_code(self, fullname: str) -> CodeType:  # noqa: ARG002 - the loader is of one module
        """Compile the changed source, past what is kept of the true one."""
        source = self.get_data(self.path).decode()
        if source.count(self.fault["text"]) != 1:
            message = f"{self.path}: the text of the fault is not there once"
            raise ImportError(message)
        changed = source.replace(self.fault["text"], self.fault["replacement"])
        code: CodeType = compile(changed, self.path, "exec")
        return code


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the one module."""

    def __init__(self, fault: dict[str, str]) -> None:
        self.fault = fault
        self.name = fault["file"].removesuffix(".py").removesuffix("/__init__").replace("/", ".")

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how the module is loaded; all others are found as ever."""
        if fullname != self.name:
            return None
        spec = PathFinder.find_spec(fullname, path)
        if spec is not None and spec.origin is not None:
            spec.loader = _Faulty(fullname, spec.origin, self.fault)
        return spec


if "BLOCKSIM_FAULT" in os.environ:
    sys.meta_path.insert(0, _Finder(json.loads(os.environ["BLOCKSIM_FAULT"])))
