"""Contact laws: how the force F of a contact grows with the overlap d. A new one is a line of `LAWS`.

A law is a power, F = K d^n, scaled by the elastic modulus E* of both bodies (1/E* = sum (1 - nu^2)/E): K = E* times a
quantity of the contact in m^(2 - n). All else follows from n: force, slope and energy (kernels/explicit/laws.py), the
unit N/m^n of K, the deepest overlaps, and the dashpot of a coefficient of restitution.

linear: Eqs 8 and 9 of Huyen & Cuong 2020; K = E* L, L (m) the shorter depth of both bodies.

hertz-mindlin: spheres, K = 4/3 E* R*^(1/2). H. Hertz, J. reine angew. Math. 92 (1881) 156-171; K. L. Johnson, Contact
Mechanics (1985), ch. 4. A corner of a block has no radius of its own, so R* (m) is an input (`contact_radius`). The
shear stiffness 8 G* sqrt(R* d) of R. D. Mindlin, J. Appl. Mech. 16 (1949) 259-268, is the slope of the normal force,
2 E* sqrt(R* d), times 4 G*/E*: the same ratio as for the linear law.
"""

import math
from collections.abc import Callable
from typing import NamedTuple


class Law(NamedTuple):
    """A contact law."""

    name: str
    exponent: float  # n, 1 or more
    size: Callable[[float, float], float]  # K/E* (m^(2 - n)) from the shorter depth and `contact_radius` (m)

    @property
    def is_linear(self) -> bool:
        """Return True if the stiffness is the same at every overlap."""
        return self.exponent == 1.0

    @property
    def damping_share(self) -> float:
        """Return the damping ratio over that of the linear law, for the same restitution: ((n + 1)/(2 n))^(1/2).

        It refers to the slope k_t = n K x^(n-1) of the force at each overlap, the dashpot being 2 z sqrt(m k_t). With
        m = K = 1 and p = dx/dt, p dp/dx = -x^n - 2 z n^(1/2) x^((n-1)/2) p. With w = x^((n+1)/2) this is
        p dp/dw = -2/(n+1) w - 2 z' (2/(n+1))^(1/2) p, z' = z (2 n/(n+1))^(1/2): the phase plane of a linear oscillator
        of damping ratio z'. The force is zero where w = -2 z n^(1/2) p in both. So e(z) of a power is the linear
        e(z'), at any speed. (For n = 3/2 and contacts that end at zero overlap the map is that of D. Antypov and J. A.
        Elliott, "On an analytical solution for the damped Hertzian spring", EPL 94 (2011) 50004.)
        """
        return math.sqrt((self.exponent + 1.0) / (2.0 * self.exponent))

    def compression(self, stiffness: float, force: float) -> float:
        """Return the overlap (m) that bears a force (N)."""
        return float((force / stiffness) ** (1.0 / self.exponent))

    def greatest_slope(self, stiffness: float, inverse_mass: float, speed: float, weight: float) -> float:
        """Return the slope (N/m) of the force where a mass (1/kg) at some speed (m/s), or a weight (N), comes to rest.

        An impact goes to d = ((n + 1) m v^2/(2 K))^(1/(n+1)), as m v^2/2 = K d^(n+1)/(n+1). Where nothing can move,
        and with the linear law, that is K.
        """
        if self.is_linear or inverse_mass == 0.0:
            return stiffness
        power = self.exponent + 1.0
        impact = (0.5 * power * speed**2 / (inverse_mass * stiffness)) ** (1.0 / power)
        deepest = max(impact, self.compression(stiffness, weight))
        return float(self.exponent * stiffness * deepest ** (self.exponent - 1.0))


LAWS = {
    law.name: law
    for law in (
        Law("linear", 1.0, lambda depth, _: depth),
        Law("hertz-mindlin", 1.5, lambda _, radius: 4.0 / 3.0 * math.sqrt(radius)),
    )
}
LINEAR = LAWS["linear"]
