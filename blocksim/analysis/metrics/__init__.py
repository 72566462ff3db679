"""Metrics that compare an ensemble with repeats, each in its file (two in inside.py) and in the line here."""

from blocksim.analysis.metrics.area import AREA
from blocksim.analysis.metrics.inside import INSIDE, PREDICTION
from blocksim.analysis.metrics.joint import JOINT
from blocksim.analysis.metrics.metric import Metric
from blocksim.analysis.metrics.outcome import OUTCOME
from blocksim.analysis.metrics.validation import VALIDATION

METRICS: dict[str, Metric] = {metric.name: metric for metric in (INSIDE, OUTCOME, VALIDATION, PREDICTION, AREA, JOINT)}
