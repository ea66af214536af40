"""Check an exported FMU against the standard and against the Python model from which it was made."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from stiffness_model.errors import InputError, expect
from stiffness_model.io.atomic_files import scratch_folder

from ..model.component import KINDS, component_files, load_component
from ..xml.archive import FmuFile, read_archive, read_members
from .check_report import CheckReport
from .run_checks import check_derivatives, check_references, check_runs
from .static_checks import check_declaration, check_fmi3_rules, check_standard, declared_variables

if TYPE_CHECKING:
    from ..model.component import Component


def check_fmu(path: str | os.PathLike[str]) -> CheckReport:
    """Validate the FMU at `path`, of this package, and run it against the model in its resources.

    The tests of the file: `standard` (problems that FMPy's validation finds); in FMI 3.0 `references` and `unknowns`
    (see `fmi3_rules`); `declaration` (variables and a GUID that differ from those of the model inside).

    The tests of its runs: `agreement` with the Python model, over reversals at several amplitudes with a turning crank
    and uneven steps; `reset` and `restore` (a second run after fmi2Reset, and one from a state that was saved in
    mid-run, serialised and read back, in this and in a second instance, without any difference); `refusal` (an input
    that is not a number gives fmi2Discard and leaves the state unchanged); `independence` (two instances that step
    alternately, against each alone); `parameters` (agreement with every tunable parameter changed); `replay` (the
    reference results that the FMU contains); with the native back end `derivatives` (directional derivatives of outputs
    and rates against differences of the model).

    Errors: `InputError` for a file that is not an FMU of this package, is damaged, or cannot run on this machine.
    """
    file = read_archive(path)
    origin = f"kind {file.kind}" if file.kind else f"one by {file.generation_tool or 'an unnamed tool'}"
    expect(file.kind in KINDS, f"an FMU of kind {' or '.join(KINDS)} that reefmu exported", origin, str(path))
    component = embedded_component(file)
    results = [
        check_standard(file),
        *check_fmi3_rules(file),
        check_declaration(file, declared_variables(file, component)),
        *check_runs(file.path, component),
        check_references(file),
    ]
    if file.backend == "native":
        results.append(check_derivatives(file.path, component))
    return CheckReport(file.path, tuple(results))


def embedded_component(file: FmuFile) -> Component:
    """The component in the resources of an FMU. Errors: `InputError` for resources that are missing or damaged."""
    names = component_files(file.kind, file.members)
    content = read_members(file, names.values())
    with scratch_folder() as folder:
        for name, member in names.items():
            (folder / name).write_bytes(content[member])
        try:
            return load_component(folder)
        except InputError as error:
            # The temporary folder is gone when the message is read, so the message names the member instead.
            raise InputError(f"{file.path}: {str(error).replace(str(folder), 'resources')}") from None
