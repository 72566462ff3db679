"""Wrong plans of refused.toml: what is said of each is in golden/refused.txt, and nothing is written."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import BlocksimError
from blocksim.scenario import Document
from blocksim.study.converge import converge
from blocksim.study.criterion import read_criterion
from blocksim.study.fragility import fragility
from blocksim.study.limit import limit, limit_curve
from blocksim.study.manifest import Shard
from blocksim.study.plan import Variations, with_sweep
from blocksim.study.sweep import merge, sweep
from tests.golden import Golden
from tests.study.conftest import SCENARIOS
from tests.study.plans import SCATTER, SLOPE, TILTED, TILTS, cases

REFUSED: dict[str, list[dict[str, Any]]] = tomllib.loads(Path(__file__).with_name("refused.toml").read_text())
THREE = Document.read(SCENARIOS / "three_blocks_nominal.toml")


def stiffer(out: Path, vary: dict[str, Any], scheme: str) -> object:
    scene = SLOPE | {"time": {"scheme": scheme, "end": 0.1}}
    return limit(scene, vary, stands="moved < 5 mm", stiffer=True, out=out)


def drawn(_: Path, vary: dict[str, Any], mode: str = "grid", **samples: int) -> object:
    return cases(THREE, Variations(vary, {key: f"{key}=typed" for key in vary}), mode, **samples)


def fragile(out: Path, intensity: Any = TILTS, scatter: Any = SCATTER, **wanted: Any) -> object:
    return fragility(SLOPE, intensity, scatter, **wanted, out=out)


def swept(out: Path, vary: Any = None, **wanted: Any) -> object:
    if "shard" in wanted:
        wanted["shard"] = Shard.parse(wanted["shard"])
    return sweep(THREE, vary, **wanted, out=out)


def tabled(out: Path, text: str | None = None) -> object:
    path = out.with_name("samples.csv")
    path.unlink(missing_ok=True)
    if text is not None:
        path.write_text(text)
    plan = {"sweep": {"mode": "table", "table": path.name}}
    return with_sweep(Document.from_mapping(SLOPE | plan, out.parent), None)


def converged(out: Path, scheme: str = "explicit", **wanted: Any) -> object:
    slide = Document.read(SCENARIOS / "slide.toml").with_values({"time.scheme": scheme})
    return converge(slide, **wanted, out=out)


STUDIES: dict[str, Callable[..., object]] = {
    "criterion": lambda _, text: read_criterion(text),
    "limit": lambda out, vary: limit(SLOPE, vary, out=out),
    "curve": lambda out, over: limit_curve(SLOPE, TILTED, over, out=out),
    "stiffer": stiffer,
    "fragility": fragile,
    "sweep": swept,
    "plan": drawn,
    "table": tabled,
    "converge": converged,
    "merge": merge,
}


@pytest.mark.parametrize("study", REFUSED)
def test_a_wrong_plan_is_refused_before_anything_is_written(study: str, tmp_path: Path, golden: Golden) -> None:
    told = []
    for wrong in REFUSED[study]:
        with pytest.raises(BlocksimError) as caught:
            STUDIES[study](tmp_path / "out", **wrong)
        told.append(f"{json.dumps(wrong)}\n{caught.value}\nexit code {caught.value.exit_code}\n")
        assert not (tmp_path / "out").exists()
    golden("\n".join(told))
