"""Worker processes that end with the run that started them."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import active_children


@contextmanager
def workers_end_with_us() -> Iterator[None]:
    """After Ctrl-C or any other exception what still runs is of no use to anyone."""
    others = set(active_children())
    try:
        yield
    except BaseException:
        for worker in set(active_children()) - others:
            worker.terminate()
        raise


@contextmanager
def no_ctrl_c_for_what_starts_here() -> Iterator[None]:
    """Ctrl-C reaches the whole process group, but we end the workers ourselves; it waits for us until we are back."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows: a worker that is still starting may show a trace
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
