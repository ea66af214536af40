"""Tests of an FMU that do not run it: its description against the standard and against the model in its resources."""

from __future__ import annotations

import math
import re

from stiffness_model.errors import InputError, expect

from ..model.component import Component
from ..model.declaration import declare, declare_with_derivatives
from ..model.variables import FMI_VERSIONS, INDICATOR_PREFIX, Variable
from ..xml.archive import SCRIPT_NAME, FmuFile, read_members
from .check_report import CheckResult
from .fmi3_rules import rule_violations


def check_standard(file: FmuFile) -> CheckResult:
    """The problems that FMPy's validation finds."""
    from fmpy.validation import validate_fmu

    try:
        problems = validate_fmu(str(file.path))
    except Exception as error:  # FMPy and its parser raise many types of exception for an invalid description
        problems = [str(error)]
    return CheckResult("standard", not problems, len(problems), 0, " ".join(" ".join(problems[:3]).split()))


def check_fmi3_rules(file: FmuFile) -> list[CheckResult]:
    """One result for each of the rules of `fmi3_rules`; none for FMI 2.0."""
    return [
        CheckResult(name, not problems, len(problems), 0, "; ".join(problems[:3]))
        for name, problems in rule_violations(file).items()
    ]


def declared_variables(file: FmuFile, component: Component) -> tuple[Variable, ...]:
    """The variables that the back end of this file declares for this component."""
    return (declare_with_derivatives(component) if file.backend == "native" else declare(component)).variables


def check_declaration(file: FmuFile, variables: tuple[Variable, ...]) -> CheckResult:
    """The variables and the GUID in the description that differ from those of the model in the resources.

    They differ where the model was exchanged after the export, or where another version of this package exported it.
    """
    from fmpy import read_model_description

    first = FMI_VERSIONS[file.fmi_version].first_reference
    try:
        description = read_model_description(str(file.path), validate=False)
    except Exception as error:  # as in `check_standard`
        raise InputError(
            f"{file.path}: expected a description that fmpy reads, got {' '.join(str(error).split())}"
        ) from None
    declared = {
        v.name: (v.valueReference - first, v.causality, v.variability, v.unit, _number(v.start))
        for v in description.modelVariables
        if v.causality != "independent" and not v.name.startswith(INDICATOR_PREFIX)
    }
    expected = {
        v.name: (v.reference, v.causality, v.variability, v.unit, math.nan if v.start is None else v.start)
        for v in variables
    }
    differing = sorted(
        name for name in declared.keys() | expected.keys() if repr(declared.get(name)) != repr(expected.get(name))
    )  # compared as text, because NaN differs from NaN
    if _script_guid(file) != file.guid:
        differing.insert(0, "guid")
    return CheckResult("declaration", not differing, len(differing), 0, ", ".join(differing[:5]))


def _number(text: str | None) -> float | str:
    """A start value; a text that is not a number stays a text and thus differs from every number."""
    try:
        return float(text or "nan")
    except ValueError:
        return f"{text!r}"


def _script_guid(file: FmuFile) -> str:
    """The GUID in the script of a Python FMU. A native FMU compares the GUID itself, so its own is returned."""
    if SCRIPT_NAME not in file.members:
        return file.guid
    script = f"resources/{read_members(file, [SCRIPT_NAME])[SCRIPT_NAME].decode('utf-8', 'replace')}.py"
    expect(script in file.members, f"the script {script}, which {SCRIPT_NAME} names", "none", str(file.path))
    found = re.search(rb'^ *fmu_guid = "(.*)"$', read_members(file, [script])[script], re.MULTILINE)
    return "" if found is None else found[1].decode("utf-8", "replace")
