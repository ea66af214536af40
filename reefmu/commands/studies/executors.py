"""Executors that evaluate designs: processes of this machine, or the workers of a dask scheduler."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
from collections.abc import Generator
from concurrent.futures import BrokenExecutor, Executor
from typing import Any

from stiffness_model.errors import InputError, install_command

from ..terminal.worker_processes import process_pool

CONNECTION_TIMEOUT = 10
"""s, to wait for a scheduler; chosen by judgement."""


@contextlib.contextmanager
def study_executor(args: argparse.Namespace) -> Generator[Executor]:
    """The executor that `--workers` or `--scheduler` asks for."""
    if args.scheduler is None:
        with process_pool(args.workers) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError(f"--scheduler: expected dask.distributed, got none: {install_command('cluster')}") from None
    try:
        asyncio.run(_try_connection(args.scheduler))
        client: Any = Client(args.scheduler, timeout=CONNECTION_TIMEOUT, set_as_default=False)
    except Exception as error:  # Depends on the transport that the address names.
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(
            f"--scheduler: expected the address of a running dask scheduler, such as "
            f"tcp://host:8786, got {args.scheduler!r} ({reason})"
        ) from None
    with client:
        try:
            # A chunk of a lost worker is evaluated again by another one, with the same numbers.
            yield client.get_executor(pure=False, retries=3)
        except (ImportError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "deserialization" not in str(error):
                raise
            raise InputError(
                "--scheduler: expected a scheduler and workers with this version of reefmu installed, got "
                f"{str(error).splitlines()[0]!r}"
            ) from None
        except Exception as error:
            if type(error).__module__.split(".")[0] != "distributed":
                raise
            raise BrokenExecutor(str(error).splitlines()[0]) from None


async def _try_connection(address: str) -> None:
    """Connect once and disconnect: a `Client` without a scheduler keeps a thread that fails when the program ends."""
    from distributed.comm.core import connect
    from distributed.security import Security

    security: Any = Security()
    comm: Any = await connect(address, timeout=CONNECTION_TIMEOUT, **security.get_connection_args("client"))
    await comm.close()
