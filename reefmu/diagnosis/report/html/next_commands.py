"""What to do after a diagnosis, as commands to type."""

from __future__ import annotations

import shlex
from dataclasses import dataclass

from ....effects.effect_facts import may_be_named, plan_call
from ...schema import Diagnosis
from ..rivals import rivals
from .origin import Origin, command_text, with_options

MODEL = "model.toml"
ASSUMED_RIG = "assumes a rig that turns the crank and heats the drive; --rig RIG.toml describes another one"
"""What a plan takes for granted without a description of the rig, which need not be that of the record."""


@dataclass(frozen=True)
class NextCommand:
    """A command line and what it is good for."""

    purpose: str
    command: str


def next_commands(
    diagnosis: Diagnosis, origin: Origin, record: str = "", *, ratio_known: bool = True
) -> list[NextCommand]:
    """Commands for the verdict: export the corrected model, plan the test that decides, diagnose its record.

    record: file name of the record; ratio_known: whether the model holds the gear's ratio. Commands that read files of
    the report run in its folder.
    """
    found: list[NextCommand] = []
    if diagnosis.verdict == "insufficient":
        name = shlex.quote(record or "RECORD.csv")
        inspect = with_options(f"reefmu record {name}", origin.reading)
        return [NextCommand("shows what was understood of the record, and what it lacks", inspect)]
    if diagnosis.effects and diagnosis.has_model:
        found += [
            _export(ratio_known),
            NextCommand("validates it and compares it with the Python model", "reefmu check model.fmu"),
        ]
    drawing = command_text(shlex.quote(origin.base)) if origin.base and not origin.base.endswith(".csv") else ""
    effects = _effects_to_separate(diagnosis)
    if drawing and effects:
        test = f"tells {' and '.join(effects)} apart" if len(effects) > 1 else f"shows {effects[0]}"
        found.append(NextCommand(f"the shortest test that {test}; {ASSUMED_RIG}", plan_call(drawing, effects)))
    if diagnosis.verdict != "named":
        base = f"--drive {drawing}" if drawing else f"--curve {origin.base}" if origin.base else "--power-law"
        diagnose = with_options(f"reefmu diagnose NEXT.csv {base}", (*origin.assumed, *origin.reading))
        found.append(NextCommand("for the record of the next test", f"{diagnose} --out next"))
    return found


def _export(ratio_known: bool) -> NextCommand:
    purpose, command = (
        "the corrected model as an FMU, in the folder of this report",
        f"reefmu export {MODEL} -o model.fmu",
    )
    if ratio_known:
        return NextCommand(purpose, command)
    return NextCommand(
        f"{purpose}; with the gear's ratio, which this record does not show", f"{command} --set ratio=RATIO"
    )


def _effects_to_separate(diagnosis: Diagnosis) -> list[str]:
    """The named effects and those of the explanations that compete with them; empty where none does."""
    ambiguous = diagnosis.verdict == "ambiguous"
    others = [name for names in diagnosis.shown_alternatives for name in names] if ambiguous else []
    others += [name for hypothesis in rivals(diagnosis) for name in hypothesis.effects]
    if diagnosis.verdict in ("none", "unknown"):
        others += may_be_named(diagnosis.not_candidates)[:4]
    if not others:
        return []
    return may_be_named([*(effect.name for effect in diagnosis.effects), *others])
