"""What tests of commands share."""

import pytest
from typer.testing import CliRunner

from gcodejerk import cli
from gcodejerk.errors import GcodejerkError


@pytest.fixture
def command(tmp_path, monkeypatch):
    """Runs a command in a folder of its own: its exit status and everything that it says."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "150")

    def run(*arguments, input=None):
        result = CliRunner().invoke(cli.app, [str(a) for a in arguments], input=input)
        if isinstance(result.exception, GcodejerkError):
            # `main` turns these into a message on standard error and exit status 1.
            return 1, str(result.exception)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code, result.output

    return run
