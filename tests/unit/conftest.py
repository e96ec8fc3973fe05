"""What several tests share: commands in a folder of their own, a second way to four segments."""

import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gcodejerk import cli
from gcodejerk.errors import GcodejerkError

# For `jerk_sums` and `simulation`, which several modules of tests share.
sys.path.insert(0, str(Path(__file__).resolve().parent))


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


class FourSegments:
    """Profiles of Conditions I, II and III for a way of 1, by integration; shares no code with us.

    Attributes
    ----------
    A, J : ndarray, shape (n,)
        Largest moduli of acceleration and jerk. [1/s^2], [1/s^3]
    V : ndarray, shape (n,)
        Largest velocity. [1/s]
    """

    def __init__(self, condition, T1, total, points=4001):
        T1 = np.asarray(T1, float)[:, np.newaxis]
        other = 0.5 * total - T1
        d1, d2, d3, d4 = {
            "I": (T1, T1, other, other), "II": (T1, other, T1, other), "III": (T1, other, other, T1)
        }[condition]  # fmt: skip
        # Triangles of the acceleration: up to 1 and back, then down to -q and back, to rest.
        q = (d1 + d2) / (d3 + d4)
        t = np.linspace(0.0, total, points)
        self.t, dt = t, t[1] - t[0]
        corners = np.concatenate(np.broadcast_arrays(0.0, d1, d1 + d2, d1 + d2 + d3, total), axis=1)
        levels = np.concatenate(np.broadcast_arrays(0.0, 1.0 + 0 * d1, 0.0, -q, 0.0), axis=1)
        a = np.stack([np.interp(t, c, level) for c, level in zip(corners, levels, strict=True)])
        v = (
            np.cumsum(0.5 * (a + np.roll(a, 1, axis=1)) * dt, axis=1)
            - 0.5 * (a[:, :1] + a[:, -1:]) * dt
        )
        way = np.sum(0.5 * (v[:, 1:] + v[:, :-1]) * dt, axis=1)
        self.a = a / way[:, np.newaxis]
        self.V = v.max(axis=1) / way
        size = 1.0 / way
        self.A = np.maximum(1.0, q[:, 0]) * size
        jerks = np.concatenate([1.0 / d1, 1.0 / d2, q / d3, q / d4], axis=1)
        self.J = jerks.max(axis=1) * size

    def left(self, frequency, damping):
        """Displacement that a mode of participation 1 keeps, shape (n,)."""
        omega = 2.0 * np.pi * frequency
        damped = omega * np.sqrt(1.0 - damping**2)
        back = self.t[-1] - self.t
        kernel = np.exp((-damping * omega + 1j * damped) * back)
        kernel[[0, -1]] *= 0.5
        return np.abs(self.a @ kernel) * (self.t[1] - self.t[0]) / damped


@pytest.fixture
def four_segments():
    """The class `FourSegments`."""
    return FourSegments
