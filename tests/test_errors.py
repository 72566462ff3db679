"""What a program that calls blocksim goes by: each sort of error has its exit code, after sysexits.h."""

import pytest

from blocksim import errors

CODES = {
    errors.BlocksimError: 70,
    errors.InvalidInputError: 65,
    errors.ScenarioError: 65,
    errors.InputMissingError: 66,
    errors.UnavailableError: 69,
    errors.OutputExistsError: 73,
    errors.OutputError: 74,
    errors.StoppedEarlyError: 75,
}


@pytest.mark.parametrize(("error", "code"), CODES.items(), ids=lambda one: getattr(one, "__name__", one))
def test_every_sort_of_error_has_its_exit_code(error: type[errors.BlocksimError], code: int) -> None:
    assert error.exit_code == code


def test_no_sort_of_error_is_forgotten_here() -> None:
    here = {one for one in vars(errors).values() if isinstance(one, type) and issubclass(one, errors.BlocksimError)}
    assert here == set(CODES)
