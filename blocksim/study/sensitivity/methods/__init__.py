"""Methods of sensitivity analysis: one file and one line here each."""

from blocksim.study.sensitivity.methods.method import Method
from blocksim.study.sensitivity.methods.morris import MORRIS
from blocksim.study.sensitivity.methods.sobol import SOBOL

METHODS: dict[str, Method] = {method.name: method for method in (MORRIS, SOBOL)}
