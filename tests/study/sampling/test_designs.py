"""Which values go together without chance."""

from blocksim.study.design import Combinations, Together


def test_combinations_go_through_the_last_key_first() -> None:
    design = Combinations({"a": (1, 2), "b": ("x", "y", "z")})
    assert [tuple(row.values()) for row in design] == [(1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z")]
    assert [list(row) for row in design] == [["a", "b"]] * 6


def test_any_row_can_be_asked_for_alone() -> None:
    design = Combinations({str(key): range(10) for key in range(18)})
    assert len(design) == 10**18
    assert "".join(str(value) for value in design[123456789012345678].values()) == "123456789012345678"
    assert design[-1] == dict.fromkeys(design[0], 9)
    assert Together({"a": (1, 2, 3), "b": (4, 5, 6)})[1:] == [{"a": 2, "b": 5}, {"a": 3, "b": 6}]
