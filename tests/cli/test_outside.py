"""The option --allow-outside."""

from pathlib import Path

from tests.cli.conftest import SCENARIOS, Command


def test_a_table_outside_is_refused_unless_asked_for(blocksim: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "three_blocks.toml").read_text(encoding="utf-8")
    table = SCENARIOS / "experiments" / "three_blocks.csv"
    (tmp_path / "mine").mkdir()
    scenario = tmp_path / "mine" / "case.toml"
    scenario.write_text(text.replace("experiments/three_blocks.csv", str(table)), encoding="utf-8")
    refused = blocksim("check", scenario, "--quiet")
    assert refused.code == 65
    line = 1 + text[: text.index("experiments/three_blocks.csv")].count("\n")
    assert f"case.toml:{line}: experiment.table" in refused.err
    assert "--allow-outside" in refused.err
    assert blocksim("check", scenario, "--quiet", "--allow-outside").code == 0
    assert blocksim("check", scenario, "--quiet").code == 65, "asked for once, allowed ever after"
