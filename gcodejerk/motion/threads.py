"""Threads of the linear algebra behind numpy, held back where matrices are small."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any


def one_thread() -> AbstractContextManager[Any]:
    """Let products of small matrices run in one thread: sharing them out costs more than they do.

    Returns
    -------
    context manager
        Which does nothing where threadpoolctl is not installed.
    """
    try:
        from threadpoolctl import threadpool_limits
    except ImportError:
        return nullcontext()
    limits: AbstractContextManager[Any] = threadpool_limits(limits=1)
    return limits
