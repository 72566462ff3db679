"""Threads that advance one world together, for scenes of hundreds of blocks and more."""

import threading
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import Self

from blocksim.errors import InvalidInputError
from blocksim.kernels.common import arrays, jit
from blocksim.simulation.schemes import BODIES_A_THREAD, AnyScene, Scene, scheme_of

START_SECONDS = 60.0


def useful_threads(threads: int, bodies: int, least_bodies: int = BODIES_A_THREAD) -> int:
    """Return how many of `threads` are of use for a scene; the result is the same for any number, bit for bit.

    `bodies` are blocks and elements of further systems, `least_bodies` is the scheme's.
    """
    most = 1 if jit.config.DISABLE_JIT else max(1, bodies // least_bodies)
    return min(threads, most)


def team_for(scene: AnyScene, threads: int, elements: int = 0) -> "Team":
    """Return a team of as many of `threads` as are of use for a scene with so many elements of further systems.

    Raises ValueError for less than one.
    """
    bodies = scene.world.bodies.size - 1 + elements
    return Team(useful_threads(threads, bodies, scheme_of(scene).least_bodies))


class Team:
    """A fixed number of threads that advance a world, this one among them."""

    def __init__(self, threads: int = 1) -> None:
        """Take as many as are asked for, however many cores there are. Raises ValueError for less than one."""
        if threads < 1:
            raise ValueError(f"threads must be at least 1, not {threads}")
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def __enter__(self) -> Self:
        """Start the other threads. Raises InvalidInputError where the system does not give that many."""
        if self._pool is not None:
            everybody = threading.Barrier(self.threads, timeout=START_SECONDS)
            try:
                for _ in range(self.threads - 1):
                    self._pool.submit(everybody.wait)
                everybody.wait()
            except RuntimeError as error:  # no more threads, or one that does not start
                everybody.abort()
                raise InvalidInputError(f"{self.threads} threads cannot be started here: {error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the other threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def advance(self, scene: Scene, last_step: int) -> tuple[Scene, int]:
        """Advance to a step, giving the pair lists more room as often as needed; return scene and status code."""
        scheme = scheme_of(scene)
        if scheme.threads_of(scene) != self.threads:
            scene = scheme.with_threads(scene, self.threads)
        status = self._advance(scene, last_step)
        while status == arrays.PAIRS_FULL:
            scene = scheme.with_more_room(scene)
            status = self._advance(scene, last_step)
        return scene, status

    def _advance(self, scene: Scene, last_step: int) -> int:
        scheme = scheme_of(scene)
        if self._pool is None:
            return scheme.advance(scene, last_step)
        scene.world.team[arrays.TEAM_SIZE] = self.threads
        others = [scheme.for_another_thread(scene) for _ in range(1, self.threads)]
        for k, other in enumerate(others, start=1):
            self._pool.submit(scheme.advance_in_team, other, last_step, k)
        return int(scheme.advance_in_team(scene, last_step, 0))


ALONE = Team()
