"""blocksim schema: the JSON Schema of scenario files, for editors."""

from blocksim.cli.output import print_json
from blocksim.scenario import json_schema


def schema_command() -> None:
    """Print the JSON Schema of scenario files, for editors.

    An editor with a TOML language server completes and checks keys with it.

    Example: blocksim schema > scenario.schema.json
    """
    print_json(json_schema())
