"""JSON Schema of the scenario file, for editors and other programs."""

from typing import Any

from blocksim.scenario.models.scenario import Scenario

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """Describe the file as users write it: quantities as SI numbers or as strings with a unit."""
    return {"$schema": DIALECT, **Scenario.model_json_schema(by_alias=True, mode="validation")}
