"""The explicit scheme for scenes with systems beside blocks and supports: its own functions, given the world inside."""

from collections.abc import Callable
from typing import Any

from blocksim.kernels.common.systems import Coupled
from blocksim.kernels.explicit.step import advance_coupled_alone, advance_coupled_in_team
from blocksim.simulation.contacts import Rows
from blocksim.simulation.schemes.scheme import Scheme


def _inside(change: Callable[..., Any]) -> Callable[..., Coupled]:
    """Return what changes the world of a scene."""
    return lambda scene, *values: scene._replace(world=change(scene.world, *values))


def _advance(scene: Coupled, last_step: int) -> int:
    return int(advance_coupled_alone(scene, last_step))


def coupled_scheme(plain: Scheme) -> Scheme:
    """Return a scheme for scenes with further systems, from that for worlds alone."""

    def contacts(scene: Coupled, blocks: int) -> Rows:
        return plain.contacts(scene.world, blocks)

    return Scheme(
        name=plain.name,
        scene_type=Coupled,
        ledger=plain.ledger,
        construction=plain.construction,
        advance=_advance,
        measure=lambda scene, row: plain.measure(scene.world, row),
        kernels=plain.kernels,
        least_bodies=plain.least_bodies,
        advance_in_team=advance_coupled_in_team,
        with_more_room=_inside(plain.with_more_room),
        with_threads=_inside(plain.with_threads),
        threads_of=lambda scene: plain.threads_of(scene.world),
        for_another_thread=_inside(plain.for_another_thread),
        contacts=contacts,
    )
