"""Measured tables, comparison with them, and closed forms: functions of tables and numbers only."""
