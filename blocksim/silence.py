"""The default of everything that is called with news of a run or a study: nothing happens."""


class _Silent:
    def __call__(self, *news: object) -> None:
        """Do nothing."""

    def __repr__(self) -> str:
        """Return the name by which signatures in `help` show it."""
        return "silent"


silent = _Silent()
