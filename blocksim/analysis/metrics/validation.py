"""Error and uncertainties after ASME V&V 20-2009, for every measured length.

E = S - D, with S the mean of the ensemble and D that of the repeats. u_val = sqrt(u_num^2 + u_input^2 + u_D^2), where
u_input is the standard deviation (divisor n - 1) of the members, which stands for the inputs' uncertainty only if the
members sample it, u_D that of the measured mean with its reading (see analysis/compare.py), and u_num is given. The
error of the model itself lies in E +- 2 u_val, at about 95 %; |E| <= 2 u_val means that it cannot be distinguished from
zero.
"""

from math import hypot, isfinite, nan

import numpy as np

from blocksim.analysis.compare import data_uncertainty
from blocksim.analysis.metrics.metric import BLOCK, Column, Evidence, Findings, Form, Metric, Pair, Row

COVERAGE = 2.0  # factor k of the expanded uncertainty, about 95 %
ENOUGH = 2  # values that a standard deviation needs


def _find(evidence: Evidence) -> Findings:
    lengths = evidence.lengths
    rows = tuple(_row(pair, evidence.u_num) for pair in lengths)
    messages = [f"u_num = {evidence.u_num:g} mm"] if rows else ["no length was measured"]
    if any(pair.known.size < ENOUGH for pair in lengths):
        messages.append("u_input needs two samples with a value")
    if any(pair.measured.n < ENOUGH for pair in lengths):
        messages.append("u_D needs two repeats")
    return Findings(rows, tuple(messages))


def _row(pair: Pair, u_num: float) -> Row:
    values, measured = pair.known, pair.measured
    simulated = float(np.mean(values)) if values.size else nan
    error = simulated - measured.mean
    u_input = float(np.std(values, ddof=1)) if values.size >= ENOUGH else nan
    u_data = data_uncertainty(measured.s, measured.n)
    u_val = hypot(u_num, u_input, u_data)
    return {
        **pair.head,
        "members": int(values.size),
        "S": simulated,
        "D": measured.mean,
        "E": error,
        "u_num": u_num,
        "u_input": u_input,
        "u_D": u_data,
        "u_val": u_val,
        "within": abs(error) <= COVERAGE * u_val if isfinite(u_val) and isfinite(error) else None,
    }


VALIDATION = Metric(
    "validation",
    "error and uncertainty after ASME V&V 20 (mm)",
    (
        *BLOCK,
        Column("members", "", Form.COUNT, "samples with a value, used for S and u_input"),
        Column("S", "S", Form.NUMBER, "mean of the samples"),
        Column("D", "D", Form.NUMBER, "mean of the repeats"),
        Column("E", "E", Form.NUMBER, "S - D"),
        Column("u_num", "", Form.NUMBER, "standard uncertainty of the numerical solution (--u-num)"),
        Column("u_input", "u_input", Form.NUMBER, "standard deviation of the samples"),
        Column("u_D", "u_D", Form.NUMBER, "of D: sqrt(s^2/n + 0.5^2), reading included"),
        Column("u_val", "u_val", Form.NUMBER, "sqrt(u_num^2 + u_input^2 + u_D^2)"),
        Column("within", "|E|<=2u", Form.TEXT, "|E| <= 2 u_val: no error of the model is detected"),
    ),
    _find,
)
