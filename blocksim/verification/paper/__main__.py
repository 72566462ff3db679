"""`python -m blocksim.verification.paper FOLDER`: run the shipped scenarios, write figures, tables and an index."""

import sys
from pathlib import Path

from blocksim.verification.paper.write import write_paper

if __name__ == "__main__":
    write_paper(Path(sys.argv[1]), Path("scenarios"))
