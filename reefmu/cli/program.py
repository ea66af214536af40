"""The program: parse the call, run the command, and turn what it raises into one line and an exit status.

Exit status 0 done, 1 a check failed, 2 the input or the call was wrong: then one line on stderr, no traceback, no
half-written file. A signal ends a command with one line too and status 128 + its number, and nothing is left behind.
"""

from __future__ import annotations

import os
import shlex
import sys
import time
from collections.abc import Sequence

from .exit_status import DONE, FAILED, WRONG_INPUT, report_error
from .interrupt import interrupts_restored, signal_exit_status, signals_raised
from .parser import build_parser

GROUP_PAUSE = 0.2
"""s, for which a lost worker waits for a signal to this process: a signal to a process group may reach the workers
first. Chosen by judgement."""
BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables that limit the threads of linear algebra; libraries read them when they are loaded."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    argv: the words of the call without the program's name; `sys.argv` by default. Raises `SystemExit` for `--help`,
    `--version` and a call that is no command.
    """
    with signals_raised(last=argv is None):
        try:
            return _run(argv)
        except KeyboardInterrupt as stop:
            return report_error(_with_notes("interrupted", stop), signal_exit_status(stop))


def _run(argv: Sequence[str] | None) -> int:
    for name in BLAS_THREADS:  # Worker processes use all cores already.
        os.environ.setdefault(name, "1")
    try:
        if os.environ.get("SOURCE_DATE_EPOCH"):
            from datetime import UTC, datetime

            from reefmu.source_date import source_date

            source_date(datetime.now(UTC))
        args = build_parser().parse_args(argv)
        args.command_line = shlex.join(["reefmu", *(sys.argv[1:] if argv is None else argv)])
        with interrupts_restored():
            status = args.run(args)
        sys.stdout.flush()
        return status
    except BrokenPipeError:
        # The reader of our output has closed its end (`reefmu ... | head`), which is no error. What is still in the
        # buffer would raise once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:
        return report_error(str(error), WRONG_INPUT)
    except MemoryError as error:
        return report_error(f"not enough memory for this ({error})", WRONG_INPUT)
    except RuntimeError as error:
        from concurrent.futures import BrokenExecutor

        if not isinstance(error, BrokenExecutor):
            raise
        time.sleep(GROUP_PAUSE)
        return report_error(_with_notes(f"the workers were lost ({error})", error), FAILED)
    except ValueError as error:
        from stiffness_model.errors import InputError

        if not isinstance(error, InputError):
            raise
        return report_error(str(error), WRONG_INPUT)


def _with_notes(message: str, error: BaseException) -> str:
    """The message, and the notes that were added to the exception on its way."""
    return "; ".join([message, *getattr(error, "__notes__", ())])
