"""Scenarios: declared in TOML, checked, and given to the other rooms as frozen objects in SI."""

from blocksim.scenario.document import (
    Document,
    Source,
    document_of,
    load_scenario,
    replace_values,
    scenario_from_mapping,
)
from blocksim.scenario.model import Model, derived
from blocksim.scenario.models.contact import GROUND
from blocksim.scenario.models.scenario import Scenario, json_schema
from blocksim.scenario.models.study import Sweep
from blocksim.scenario.placement import PlacedBody, PlacedSegment, place_segments
from blocksim.scenario.resolution import resolve_pair, scenario_to_toml

__all__ = [
    "GROUND",
    "Document",
    "Model",
    "PlacedBody",
    "PlacedSegment",
    "Scenario",
    "Source",
    "Sweep",
    "derived",
    "document_of",
    "json_schema",
    "load_scenario",
    "place_segments",
    "replace_values",
    "resolve_pair",
    "scenario_from_mapping",
    "scenario_to_toml",
]
