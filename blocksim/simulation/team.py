"""Threads that advance one world together, for scenes of hundreds of blocks and more."""

import threading
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import Self

from blocksim.errors import InvalidInputError
from blocksim.kernels.advance import advance, advance_in_team
from blocksim.kernels.arrays import PAIRS_FULL, TEAM_SIZE, World
from blocksim.kernels.jit import config
from blocksim.world.build import with_more_room, with_threads

BODIES_A_THREAD = 100  # at least; with fewer, threads wait for one another longer than they work
WORK_SPACE = ("points", "matrices", "before", "action")
START_SECONDS = 60.0


def useful_threads(threads: int, bodies: int) -> int:
    """Return how many of `threads` are of use for a scene; the result is the same for any number, bit for bit."""
    most = 1 if config.DISABLE_JIT else max(1, bodies // BODIES_A_THREAD)
    return min(threads, most)


def team_for(world: World, threads: int) -> "Team":
    """Return a team for a world, of as many of `threads` as are of use. Raises ValueError for less than one."""
    return Team(useful_threads(threads, world.bodies.size - 1))


class Team:
    """A fixed number of threads that advance a world, this one among them."""

    def __init__(self, threads: int = 1) -> None:
        """Take as many as are asked for, however many cores there are. Raises ValueError for less than one."""
        if threads < 1:
            message = f"threads must be at least 1, not {threads}"
            raise ValueError(message)
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
                message = f"{self.threads} threads cannot be started here: {error}"
                raise InvalidInputError(message) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the other threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def advance(self, world: World, last_step: int) -> tuple[World, int]:
        """Advance to a step, giving the pair lists more room as often as needed; return world and status code."""
        if world.shares.size != self.threads:
            world = with_threads(world, self.threads)
        status = self._advance(world, last_step)
        while status == PAIRS_FULL:
            world = with_more_room(world)
            status = self._advance(world, last_step)
        return world, status

    def _advance(self, world: World, last_step: int) -> int:
        if self._pool is None:
            return advance(world, last_step)
        world.team[TEAM_SIZE] = self.threads
        others = [_with_own_work_space(world) for _ in range(1, self.threads)]
        for k, other in enumerate(others, start=1):
            self._pool.submit(advance_in_team, other, last_step, k)
        return int(advance_in_team(world, last_step, 0))


def _with_own_work_space(world: World) -> World:
    """Return the same world for one more thread: with arrays of its own where one pair is worked on."""
    return world._replace(**{name: getattr(world, name).copy() for name in WORK_SPACE})


ALONE = Team()
