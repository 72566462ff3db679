"""Measured tables, comparison with them, and closed forms: functions of tables and numbers only."""

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict, compare_final
from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, PropertyTable, load_properties, load_table

__all__ = [
    "QUANTITIES",
    "Comparison",
    "ComparisonRow",
    "ExperimentTable",
    "PropertyTable",
    "Verdict",
    "compare_final",
    "load_properties",
    "load_table",
]
