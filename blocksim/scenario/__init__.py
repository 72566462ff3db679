"""Scenarios: declared in TOML, checked, and given to the other rooms as frozen objects in SI."""

from blocksim.scenario.document import (
    Document,
    Source,
    document_of,
    load_scenario,
    load_stored,
    replace_values,
    scenario_from_mapping,
)
from blocksim.scenario.models.contact import GROUND, Contact, Friction, Pair, PairFriction, Restitution
from blocksim.scenario.models.geometry import Block, BodySpec, Ground, Material, Wall
from blocksim.scenario.models.scenario import Scenario, json_schema
from blocksim.scenario.models.stepping import Output, Time
from blocksim.scenario.models.study import Experiment, Sweep
from blocksim.scenario.placement import PlacedBody, PlacedSegment, place_bodies, place_segments, surface_height
from blocksim.scenario.resolved import (
    ResolvedPair,
    body_table_contents,
    motion_table_content,
    resolve_pair,
    scenario_hash,
    scenario_to_toml,
)

__all__ = [
    "GROUND",
    "Block",
    "BodySpec",
    "Contact",
    "Document",
    "Experiment",
    "Friction",
    "Ground",
    "Material",
    "Output",
    "Pair",
    "PairFriction",
    "PlacedBody",
    "PlacedSegment",
    "ResolvedPair",
    "Restitution",
    "Scenario",
    "Source",
    "Sweep",
    "Time",
    "Wall",
    "body_table_contents",
    "document_of",
    "json_schema",
    "load_scenario",
    "load_stored",
    "motion_table_content",
    "place_bodies",
    "place_segments",
    "replace_values",
    "resolve_pair",
    "scenario_from_mapping",
    "scenario_hash",
    "scenario_to_toml",
    "surface_height",
]
