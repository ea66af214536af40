"""Files beside the model that an FMU carries for its importer: sets of parameters, stimuli and reference results.

They lie where the layered standard FMI-LS-REF expects them (https://github.com/modelica/fmi-ls-ref, 1.0.0-alpha.1),
with a manifest; the experiment is described in the format that this standard names (MA-HS-Experiments).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, register_namespace

import numpy as np

from stiffness_model.numerics.arrays import Array

from .model.component import MODEL_FILE, Component
from .model.nominals import eigenfrequency, joint_masses, rounded_down, twist_at_full_torque
from .model.presets import Preset
from .model.variables import Interface
from .xml.description import ExportInfo, to_bytes
from .xml.parameter_values import MIME_TYPE, parameter_set

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST, EXPERIMENTS, STIMULI, REFERENCES = "fmi-ls-manifest.xml", "loops.exp", "loops-in.csv", "loops-ref.csv"
TOLERANCE = 1e-9
"""Greatest deviation of an output from its reference, relative to the greatest magnitude of that reference. Native FMUs
agree to 1e-12 in the tests; the margin for other compilers is chosen by judgement."""
STEP = 1e-3
"""Communication step of a drive's experiment, s; of no influence on a drive without effects that depend on time."""
_MANIFEST_SPACE = "http://fmi-standard.org/fmi-ls-manifest"
_CORNERS = (0.0, 0.3, -0.29, 1.0, -0.97, 0.4)
"""Corners of the excitation, relative to the twist at full torque: a small loop and a large one. Their amplitudes
differ, so that no sample lies at zero torque, where load-dependent friction has no derivative."""
_STEPS_PER_LEG = 12


class References(NamedTuple):
    """Stimuli and the results of the Python model. names: of inputs and outputs; time: s, shape (n + 1,);

    stimuli: shape (n + 1, n_inputs), of which row k is set before the step from time k to time k + 1; results: shape
    (n + 1, n_outputs), after the steps, and in row 0 after initialisation with the first stimuli.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    time: Array
    stimuli: Array
    results: Array


def reference_results(component: Component) -> References:
    """Loops of the twist under a turning crank, or of the torques on a joint, with the results of the Python model."""
    steps = _STEPS_PER_LEG * (len(_CORNERS) - 1)
    shape = np.interp(np.arange(1, steps + 2) / _STEPS_PER_LEG, np.arange(len(_CORNERS)), _CORNERS)
    step = STEP
    ratio = next(p.value for p in component.parameters if p.name == "ratio")
    if component.kind == "joint":
        step = rounded_down(1 / eigenfrequency(component, joint_masses(component)))
        load = 0.3 * component.full_torque * shape
        signals = {"load.tau": load, "motor.tau": load / ratio}
    else:
        crank = 0.2 + 3.0 * np.arange(steps + 1) / steps
        output = crank / ratio - twist_at_full_torque(component) * shape
        signals = {
            "crank.phi": crank,
            "crank.w": np.gradient(crank, step),
            "output.phi": output,
            "output.w": np.gradient(output, step),
            "temperature": np.linspace(20.0, 30.0, steps + 1),
        }
    stimuli = np.column_stack([signals[signal.name] for signal in component.inputs])
    p = component.parameter_vector()
    states = component.initial(stimuli[0], p)
    rows = [component.output(states, stimuli[0], p)]
    for inputs in stimuli[:-1]:
        states = component.step(states, inputs, step, p)
        rows.append(component.output(states, inputs, p))
    return References(
        tuple(signal.name for signal in component.inputs),
        tuple(signal.name for signal in component.outputs),
        np.array([k * step for k in range(steps + 1)]),
        stimuli,
        np.array([np.asarray(row).ravel() for row in rows]),
    )


def related_members(
    component: Component, interface: Interface, export: ExportInfo, sets: Sequence[Preset]
) -> dict[str, bytes]:
    """The files by name in the archive; sets: the parameter sets among them."""
    references = reference_results(component)
    units = {v.name: v.unit for v in interface.variables}
    files = {
        **{f"{preset.name}.ssv": parameter_set(preset, units, export) for preset in sets},
        STIMULI: _csv(references.inputs, references.time, references.stimuli),
        REFERENCES: _csv(references.outputs, references.time, references.results),
        EXPERIMENTS: _experiments(references),
    }
    related = [
        ("application/toml", f"../../resources/{MODEL_FILE}", "model", "The drive model, as reefmu reads it"),
        ("text/html", "../../documentation/index.html", "document", "Equations, variables, signs and advice"),
        ("application/x-ma-hs-experiments", EXPERIMENTS, "experiment/smoke-test", "Loops with reference results"),
        *((MIME_TYPE, f"{preset.name}.ssv", "parameter", preset.description) for preset in sets),
    ]
    return {f"{FOLDER}/{name}": content for name, content in {**files, MANIFEST: _manifest(related)}.items()}


def read_references(stimuli: bytes, results: bytes) -> References:
    """The references in the files of an FMU. Errors: `ValueError` for text that is no table of numbers."""
    inputs, time, values = _table(stimuli)
    outputs, result_time, expected = _table(results)
    if len(time) != len(result_time):
        raise ValueError(f"{len(time)} rows of stimuli and {len(result_time)} of results")
    return References(inputs, outputs, time, values, expected)


def _table(content: bytes) -> tuple[tuple[str, ...], Array, Array]:
    head, *rows = content.decode("utf-8").splitlines()
    table = np.array([[float(value) for value in row.split(",")] for row in rows])
    return tuple(head.split(",")[1:]), table[:, 0], table[:, 1:]


def _csv(names: Sequence[str], time: Array, values: Array) -> bytes:
    rows = [",".join(repr(value) for value in row) for row in np.column_stack([time, values]).tolist()]
    return "\n".join([",".join(("time", *names)), *rows, ""]).encode()


def _experiments(references: References) -> bytes:
    root = Element("Experiments", {"name": "loops"})
    step = float(references.time[1])
    experiment = SubElement(
        root,
        "Experiment",
        {
            "name": "loops",
            "description": "Co-simulation: each row of stimuli is held over the step that begins at its time. The "
            "tolerance is that of an output, relative to the greatest magnitude of its reference.",
            "startTime": "0.0",
            "stopTime": repr(float(references.time[-1])),
            "stepSize": repr(step),
            "tolerance": repr(TOLERANCE),
        },
    )
    SubElement(experiment, "Stimuli", {"source": STIMULI})
    SubElement(experiment, "References", {"source": REFERENCES})
    return to_bytes(root)


def _manifest(related: Sequence[tuple[str, str, str, str]]) -> bytes:
    register_namespace("fmi-ls", _MANIFEST_SPACE)
    root = Element(
        "fmiReferences",
        {
            f"{{{_MANIFEST_SPACE}}}fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
            f"{{{_MANIFEST_SPACE}}}fmi-ls-version": "1.0.0-alpha.1",
            f"{{{_MANIFEST_SPACE}}}fmi-ls-description": "Layered Standard providing information on related files "
            "included in an FMU.",
        },
    )
    for mime, source, role, description in related:
        SubElement(root, "Related", {"type": mime, "source": source, "role": role, "description": description})
    return to_bytes(root)
