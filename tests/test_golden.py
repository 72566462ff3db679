"""Golden files: a text that has changed, a section too many or too few fails; only an update writes."""

from pathlib import Path

import pytest

from tests.golden import ROOT, normalised

TESTS = """
import pytest
@pytest.mark.parametrize("word", ["a", "b"])
def test_word(golden, word):
    golden(f"{word}   \\n\\n  end")
def test_paths(golden, tmp_path):
    golden(f"{tmp_path}/run.h5 after 3.25 s", rules=["times"])
    golden("two", "second")
def test_without_text():
    pass
"""
GOLDEN = """\
=== test_word[a]
a

  end

=== test_word[b]
b

  end

=== test_paths
TMP/run.h5 after TIME

=== test_paths / second
two
"""


@pytest.fixture
def case(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Return a folder with tests of golden texts, and the golden file that goes with them."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makepyfile(test_texts=TESTS)
    (pytester.mkdir("golden") / "texts.txt").write_text(GOLDEN)
    return pytester


def printed(case: pytest.Pytester, *options: str, passed: int = 0, failed: int = 0, errors: int = 0) -> str:
    """Run the tests of a folder and return what pytest printed."""
    plugins = ("-p", "tests.golden", "-p", "no:cacheprovider", "-p", "no:randomly")  # texts are in the order of tests
    result = case.runpytest_inprocess(*plugins, *options)
    result.assert_outcomes(passed=passed, failed=failed, errors=errors)
    return result.stdout.str()


def edit(case: pytest.Pytester, old: str, new: str) -> None:
    """Replace a piece of the golden file."""
    assert GOLDEN.count(old) == 1
    (case.path / "golden" / "texts.txt").write_text(GOLDEN.replace(old, new))


def test_texts_that_are_as_expected_pass_and_nothing_is_written(case: pytest.Pytester) -> None:
    printed(case, passed=4)
    assert (case.path / "golden" / "texts.txt").read_text() == GOLDEN


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("b\n\n  end", "B\n\n  end", "golden/texts.txt: test_word[[]b[]]*-B*+b*   end*`make golden` accepts*"),
        ("=== test_word[b]\nb\n\n  end\n", "", "no section 'test_word[[]b[]]'; `make golden` would write"),
    ],
)
def test_another_text_and_a_missing_one_fail_and_are_not_written(
    case: pytest.Pytester, old: str, new: str, told: str
) -> None:
    edit(case, old, new)
    before = (case.path / "golden" / "texts.txt").read_text()
    text = printed(case, passed=3, failed=1)
    assert Path(text.replace("\n", " ").replace("/", "|")).match(f"*{told.replace('/', '|')}*")
    assert "Traceback" not in text
    assert (case.path / "golden" / "texts.txt").read_text() == before


def test_a_section_that_its_test_does_not_use_fails(case: pytest.Pytester) -> None:
    edit(case, "/ second\ntwo\n", "/ second\ntwo\n\n=== test_paths / third\nthree\n")
    assert "unused sections, which `make golden` removes: test_paths / third" in printed(case, passed=4, errors=1)


def test_a_section_of_no_test_fails_once(case: pytest.Pytester) -> None:
    edit(case, "/ second\ntwo\n", "/ second\ntwo\n\n=== test_word[c]\nc\n")
    told = printed(case, passed=3, errors=1)
    assert "sections of no test, which `make golden` removes: test_word[c]" in told


def test_an_update_writes_changed_texts_and_removes_old_ones(case: pytest.Pytester) -> None:
    edit(case, "/ second\ntwo\n", "/ third\nthree\n\n=== test_gone\ngone\n")
    edited = (case.path / "golden" / "texts.txt").read_text().replace("  end\n\n=== test_word[b]", "=== test_word[b]")
    (case.path / "golden" / "texts.txt").write_text(edited)
    assert "differences written: " in printed(case, "--update-golden", passed=3)
    assert (case.path / "golden" / "texts.txt").read_text() == GOLDEN
    assert "all golden files are as the tests print" in printed(case, "--update-golden", passed=3)


def test_an_update_keeps_the_texts_of_tests_that_fail_or_do_not_run(case: pytest.Pytester) -> None:
    case.makepyfile(test_texts=TESTS.replace('golden("two", "second")', "assert False").replace("{word}", "{word}!"))
    printed(case, "--update-golden", "test_texts.py::test_paths", failed=1)
    assert (case.path / "golden" / "texts.txt").read_text() == GOLDEN


@pytest.mark.parametrize(
    ("rule", "text", "left"),
    [
        ("times", "12 steps in 3.1 s, 20 ms each, 1e-05 s", "12 steps in TIME, TIME each, TIME"),
        ("sizes", "3 files, 1.5 MB", "3 files, SIZE"),
        ("counts", "all 302 frames, 20 stored, exit code 65", "all COUNT frames, COUNT stored, exit code 65"),
        ("numbers", "row 4 by -0.5 mm, 1.2e-07 s", "row 4 by -NUMBER mm, NUMBER s"),
        ("digits", "0.3333333333333333, -1.0000000000000002e-07, 12.5, 31", "0.333333333, -1e-07, 12.5, 31"),
        ("hashes", "sha256 0123456789abcdef, 1234", "sha256 HASH, 1234"),
    ],
)
def test_rules_replace_what_varies_and_nothing_else(rule: str, text: str, left: str) -> None:
    assert normalised(text, [rule]) == left
    assert normalised(text) == text


def test_every_golden_file_lies_beside_its_tests() -> None:
    files = list((ROOT / "tests").rglob("golden/*.txt"))
    assert files
    assert [file for file in files if not (file.parents[1] / f"test_{file.stem}.py").exists()] == []
