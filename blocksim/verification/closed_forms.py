"""Closed forms for checking the simulation, derived from Newton's laws; SI, angles in radians.

Equation numbers are those of the paper (Tran and Nguyen 2020). Restitution `e` is the ratio of the normal velocities
after and before an impact (Eq. 11). Impacts are those of one corner on the ground, normal along y, tangent along x.
Rocking of a block on its base is after G. W. Housner 1963, Bull. Seismol. Soc. Am. 53, 403-417.
"""

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, sin, sqrt, tan

import numpy as np

GRAVITY = 9.81  # m/s^2, the scenarios' default


def fall_distance(time: float, gravity: float = GRAVITY) -> float:
    """Return the distance (m) fallen from rest after `time` (s): g t^2/2, Eq. 10, first form."""
    return 0.5 * gravity * time**2


def apex_height(height: float, restitution: float, impacts: int) -> float:
    """Return the apex (m) after impact number `impacts`: h_p = h0 e^(2p), Eq. 12."""
    return height * restitution ** (2 * impacts)


def flight_time(height: float, restitution: float, impacts: int, gravity: float = GRAVITY) -> float:
    """Return the time (s) from impact number `impacts` to the next: t_p = 2 e^p sqrt(2 h0/g), Eq. 12."""
    return 2.0 * restitution**impacts * sqrt(2.0 * height / gravity)


def sliding_stop_time(speed: float, friction: float, gravity: float = GRAVITY) -> float:
    """Return the time (s) to stop on level ground: V0/(mu g), where Eq. 13 reaches zero."""
    return speed / (friction * gravity)


def sliding_stop_distance(speed: float, friction: float, gravity: float = GRAVITY) -> float:
    """Return the distance (m) to stop on level ground: V0^2/(2 mu g), the integral of Eq. 13."""
    return speed**2 / (2.0 * friction * gravity)


def incline_acceleration(slope: float, friction: float, gravity: float = GRAVITY) -> float:
    """Return the acceleration (m/s^2) on a `slope` from rest: g (sin a - mu cos a), 0 if friction holds."""
    return max(gravity * (sin(slope) - friction * cos(slope)), 0.0)


def sliding_slope(friction: float) -> float:
    """Return the slope (rad) above which a block slides: arctan(mu)."""
    return atan(friction)


def toppling_slope(width: float, height: float) -> float:
    """Return the slope (rad) at which a block's weight passes its lower edge: arctan(width/height)."""
    return atan2(width, height)


def rolling_friction_limit(width: float, height: float, slope: float) -> float:
    """Return the friction coefficient that a block needs to start toppling on a slope without sliding.

    Turning from rest about its lower edge with w' (1/s^2) = 3 g (h sin a - b cos a)/(2 (b^2 + h^2)), its centre
    accelerates by w' h/2 down the slope and by w' b/2 away from it, so that per unit mass f = g sin a - w' h/2 and
    N = g cos a + w' b/2; the limit is f/N. It lies below tan a, where the chart from statics puts it (J. P. Ashby 1971;
    corrected by C. Sagaseta, Rock Mech. Rock Eng. 19 (1986) 261-266). At the toppling slope it is tan a = b/h. Needs a
    slope not below the toppling slope.
    """
    spin_rate = 1.5 * (height * sin(slope) - width * cos(slope)) / (width**2 + height**2)  # times g
    return (sin(slope) - 0.5 * spin_rate * height) / (cos(slope) + 0.5 * spin_rate * width)


def ladder_friction(slope: float, slenderness: float) -> float:
    """Return the ground friction below which a ladder of thickness/length `slenderness` slips at a smooth wall.

    It stands at `slope` (rad) to the ground on one corner and leans with another one of the same side. Moments about
    the foot: N_wall L sin a = m g (L cos a - t sin a)/2, and the ground's friction balances the wall: mu =
    N_wall/(m g) = (cot a - t/L)/2.
    """
    return 0.5 * (1.0 / tan(slope) - slenderness)


def static_overlap(mass: float, face_stiffness: float, exponent: float = 1.0) -> float:
    """Return the overlap (m) of a block resting on a face whose force is K d^n, K = `face_stiffness`: (m g/K)^(1/n)."""
    return float((mass * GRAVITY / face_stiffness) ** (1.0 / exponent))


def harmonic_offsets(count: int, width: float) -> tuple[float, ...]:
    """Return the overhang (m) of each block over its support, topmost first: width/(2 i), i = 1 ... count.

    The i uppermost blocks balance on the edge below them. The last support is a table; the sum is the
    overhang.
    """
    return tuple(width / (2.0 * index) for index in range(1, count + 1))


@dataclass(frozen=True)
class Velocity:
    """Velocity of the centre (m/s) and spin (rad/s, counter-clockwise positive)."""

    vx: float
    vy: float
    spin: float


def lowest_corner(width: float, height: float, tilt: float) -> tuple[float, float]:
    """Return the vector (m) from the centre of a rectangle turned by `tilt` to its lowest corner."""
    corners = [(sx * width / 2.0, sy * height / 2.0) for sx in (-1.0, 1.0) for sy in (-1.0, 1.0)]
    turned = [(x * cos(tilt) - y * sin(tilt), x * sin(tilt) + y * cos(tilt)) for x, y in corners]
    return min(turned, key=lambda corner: corner[1])


def corner_impact(
    mass: float, inertia: float, arm: tuple[float, float], before: Velocity, restitution: float, *, sticks: bool
) -> Velocity:
    """Return the motion after an impact at the corner `arm` (m from the centre), without friction or where it sticks.

    Without friction the impulse J along y changes the corner's normal velocity by J (1/m + r_x^2/I), which must be
    -(1 + e) times what it was before; for a block falling with v that is J = (1 + e) v/(1/m + r_x^2/I). With enough
    friction to stop the corner the impulse solves W J = u' - u: W is the corner's 2 x 2 inverse-mass matrix, u and
    u' = (0, -e u_y) are its velocities before and after. With e > 0 and a fast tangential approach Newton's rule can
    gain energy there (Kane 1984); with e = 0 it cannot.
    """
    x, y = arm
    corner = np.array([before.vx - before.spin * y, before.vy + before.spin * x])
    along, up = 0.0, -(1.0 + restitution) * float(corner[1]) / (1.0 / mass + x**2 / inertia)
    if sticks:
        coupling = -x * y / inertia
        inverse_mass = np.array([[1.0 / mass + y * y / inertia, coupling], [coupling, 1.0 / mass + x * x / inertia]])
        along, up = np.linalg.solve(inverse_mass, np.array([0.0, -restitution * corner[1]]) - corner).tolist()
    return Velocity(before.vx + along / mass, before.vy + up / mass, before.spin + (x * up - y * along) / inertia)


def rocking_quarter_time(width: float, height: float, tilt: float, gravity: float = GRAVITY) -> float:
    """Return the time (s) from rest at `tilt` (rad) on one corner to standing flat: a quarter period.

    With R the half diagonal, alpha = arctan(width/height) and I = 4 m R^2/3 about the corner, energy gives
    tilt'^2 = 2 p^2 (cos(alpha - tilt0) - cos(alpha - tilt)), p^2 = 3 g/(4 R). The integral of dtilt/tilt' is
    taken by Gauss-Legendre quadrature in s with tilt = tilt0 (1 - s^2), which removes the singularity at
    release; the difference of cosines is written as a product of sines, which keeps its digits. Needs 0 <
    tilt < alpha.
    """
    alpha = atan2(width, height)
    nodes, weights = np.polynomial.legendre.leggauss(64)  # round-off is reached with about 20
    s = 0.5 * (nodes + 1.0)
    fallen = tilt * s**2
    drop = 2.0 * np.sin(alpha - tilt + 0.5 * fallen) * np.sin(0.5 * fallen)
    frequency = sqrt(3.0 * gravity / (4.0 * 0.5 * hypot(width, height)))
    return float(0.5 * np.sum(weights * 2.0 * tilt * s / np.sqrt(2.0 * drop)) / frequency)


def housner_ratio(width: float, height: float) -> float:
    """Return spin after over spin before a rocking block's impact on its base: 1 - 1.5 sin^2 alpha.

    Angular momentum about the new corner is kept: I w' = (I - 2 m R^2 sin^2 alpha) w with I = 4 m R^2/3.
    """
    return 1.0 - 1.5 * sin(toppling_slope(width, height)) ** 2
