"""Compiled loops over flat arrays: broad phase, narrow phase, contact laws, integration and the energy ledger.

numba reads .numba_config.yaml of the current folder when it is imported and whenever it compiles. That folder may be a
stranger's, as that of a scenario, so the file is not obeyed, unless numba was imported before.
"""

import logging
import multiprocessing
import os
import sys
import warnings

SETTINGS = ".numba_config.yaml"


def _import_numba() -> None:
    """Import numba without the package that reads such a file, and have it look for none later."""
    reader = sys.modules.get("yaml")
    sys.modules["yaml"] = None  # type: ignore[assignment]  # so that importing it fails
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "A Numba config file is found")
            from numba import config  # noqa: PLC0415 - its first import
    finally:
        del sys.modules["yaml"]
        if reader is not None:
            sys.modules["yaml"] = reader
    config._config_fname = os.devnull  # noqa: SLF001 - numba has no other switch
    is_worker = getattr(multiprocessing.current_process(), "_inheriting", False)  # or about to be one
    if os.path.isfile(SETTINGS) and not is_worker:  # noqa: PTH113 - not yet imported
        text = "%s in the current folder is not obeyed; variables NUMBA_... of the environment are"
        logging.getLogger("blocksim").warning(text, SETTINGS)


if "numba" not in sys.modules:
    _import_numba()
