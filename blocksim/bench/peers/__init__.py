"""The same scenes by other engines. Nothing but the registry of measurements imports this package (make lint)."""

from blocksim.bench.peers.engine import require_all
from blocksim.bench.peers.heap import HEAP
from blocksim.bench.peers.three_blocks import PAPER, WITHOUT_RESTITUTION
from blocksim.bench.peers.wall import WALL

PEERS = (PAPER, WITHOUT_RESTITUTION, WALL, HEAP)
__all__ = ["HEAP", "PAPER", "PEERS", "WALL", "WITHOUT_RESTITUTION", "require_all"]
