"""The errors a user can meet: one line that says what, where, what is allowed and what to do next.

Every error derives from KendamaError, keeps its facts as attributes, and names the exit code that the command line
returns: 1 where a stage failed, 2 where the request itself was wrong.
"""

from __future__ import annotations


class KendamaError(Exception):
    """A failure with a message made for the user; ``exit_code`` is what the command line returns."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.splitlines()))  # what it quotes, of a user or a library, may have several


class UsageError(KendamaError):
    """The request cannot be carried out as it was written."""

    exit_code = 2


class ConfigError(UsageError):
    """A key or value of the configuration is wrong; ``key`` is its dotted name."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


class InputError(KendamaError):
    """A file that was given as input cannot be used; ``path`` is the file, ``where`` the row, column or sample."""

    exit_code = 2

    def __init__(self, path: str, problem: str, *, where: str = "", remedy: str = "") -> None:
        place = f"{path}, {where}" if where else path
        super().__init__(f"{place}: {problem}" + (f"; {remedy}" if remedy else ""))
        self.path = path
        self.problem = problem
        self.where = where
        self.remedy = remedy


class MissingPartError(KendamaError):
    """A device, program or library that the chosen block needs is not there; ``part`` names it."""

    exit_code = 2

    def __init__(self, part: str, message: str) -> None:
        super().__init__(message)
        self.part = part


def install_line(extra: str) -> str:
    """Return the command that installs the libraries of an extra of pyproject.toml: from a checkout."""
    return f"pip install '.[{extra}]' in a checkout of kendama"


def brings(module: str) -> str:
    """Return the command that installs ``module``: by the smallest extra that asks for it."""
    import importlib.metadata  # noqa: PLC0415 - slow to import, and only errors need it
    import re  # noqa: PLC0415

    lines = [one.partition("; extra == ") for one in importlib.metadata.requires("kendama-cli") or []]
    asked = [(re.split(r"[^\w-]", text)[0].replace("-", "_"), extra.strip("'\"")) for text, _, extra in lines]
    extras = sorted((extra for name, extra in asked if name == module), key=[extra for _, extra in asked].count)
    return install_line(extras[0]) if extras and extras[0] else "'kendama doctor' says what brings it"


def no_pyarrow(place: str, instead: str) -> MissingPartError:
    """Return the error of a Parquet file without pyarrow; ``instead`` says what to do without it."""
    return MissingPartError("pyarrow", f"{place}: Parquet needs pyarrow; {install_line('parquet')}, {instead}")


class StageError(KendamaError):
    """A stage could not do its work with valid input; nothing that was finished is lost."""


class LogMessageError(StageError):
    """A stage logged what it does not declare; ``topic`` is the message's topic, or empty where a type is at fault."""

    def __init__(self, message: str, topic: str = "") -> None:
        super().__init__(message)
        self.topic = topic


class SimulationError(StageError):
    """The simulation met a value that is not finite or left its domain; ``quantity`` names it, ``t_s`` says when."""

    def __init__(self, quantity: str, t_s: float, message: str) -> None:
        super().__init__(message)
        self.quantity = quantity
        self.t_s = t_s


class HardwareError(StageError):
    """The line to the robot failed, or the robot stopped; the robot is in its latched stop."""


class StoreError(KendamaError):
    """The store cannot be read or written (a full disk, a damaged object); ``path`` is the place."""

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path


class ReadOnlyError(StoreError):
    """The place cannot be written now, by this user or because it is full, though nothing may be wrong with it."""


class RemoteError(StoreError):
    """The shared store is not one, or refuses what is asked: a bucket that is not there, a wrong secret."""

    exit_code = 2


class OfflineError(RemoteError):
    """The shared store cannot be reached now; the home folder alone will do."""

    exit_code = 1


class ClusterError(KendamaError):
    """The machines that should compute cannot be reached, or are of another kind; ``address`` is the scheduler's."""

    def __init__(self, address: str, message: str) -> None:
        super().__init__(message)
        self.address = address


class FormatError(StoreError):
    """A file was written in another format than the one that is read here; ``found`` and ``known`` are the two."""

    exit_code = 2

    def __init__(self, path: str, what: str, found: object, known: object) -> None:
        super().__init__(
            path,
            f"{path}: {what} of format {found}, and this version of kendama reads format {known}; read it with the "
            f"version that wrote it",
        )
        self.found = found
        self.known = known
