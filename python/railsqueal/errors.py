"""The one error of the package. Its code is the exit code of the program that meets it, as the solver has them."""

USAGE, INPUT, WRITING = 2, 3, 6


class ResultError(Exception):
    """A result file that cannot be used for what is asked of it: the message names the file, what was found and what to
    do."""

    def __init__(self, message: str, code: int = INPUT) -> None:
        super().__init__(message)
        self.code = code


class InputError(ResultError):
    """A drawing or table that cannot be used: the message names the file and place, what was found and what to do."""
