"""Commands as a person types them, in this process."""

from __future__ import annotations

import pytest

from kendama_cli.cli.main import main


def kendama(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    code = main(list(words))
    out, err = capsys.readouterr()
    return code, out, err


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line that tells why, of a request that is wrong."""
    code, _, err = kendama(capsys, *words)
    assert code == 2, err
    (line,) = [line for line in err.splitlines() if line.startswith("kendama: ")]
    return line
