"""The tables of a scenario as frozen pydantic models; attributes are SI floats."""
