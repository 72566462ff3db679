"""blocksim schema: the JSON Schema of scenario files, for editors."""

from blocksim.cli.output import print_json
from blocksim.scenario import json_schema


def schema_command() -> None:
    """Print the JSON Schema of scenario files, for editors that complete and check TOML.

    Example: blocksim schema > scenario.schema.json
    """
    print_json(json_schema())
