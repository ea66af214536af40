"""Torque of base curve plus effects over a trace, and its exact sensitivities to every parameter.

The stages and their order are those of `reefmu.model.stages.order`, evaluated by `record_stages`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from .base_curve import BaseCurve
from .effect_functions import Dual, effect_functions
from .parameter_layout import DELAY, ParameterLayout
from .record_contacts import RecordContacts
from .record_stages import RecordStages

LEAST_GAIN = 0.1
"""Least gain that is distinguished: less is that of a drive which friction nearly locks. Chosen by judgement."""


class Contacts(NamedTuple):
    """twist: (n,) rad, of the contacts; clearance: (n,) m, beyond the drawn one; gain: (n,), what the measured torque
    changes by with the torque that the drawing's contacts have at this twist, over the geometric mean along the record.

    A record tells where a drive scatters more than elsewhere; that it scatters more as a whole is no evidence of its
    effects, since tolerances are not known so well.
    """

    twist: Array
    clearance: Array
    gain: Array


@dataclass(frozen=True)
class Prediction:
    """torque: (n,) N.m; sensitivities: (n, k) by the parameters of rig, base shape and effects, in that order;
    elastic: (n,) N.m; slope: (n,) stiffness, N.m/rad; n: blocks where the predictor has blocks, else samples.
    """

    torque: Array
    sensitivities: Array
    elastic: Array
    slope: Array
    contacts: Contacts


class Predictor:
    """Evaluates one set of effects on one trace; means over `blocks` of it, if given. size: of the parameters."""

    def __init__(self, trace: Trace, base: BaseCurve, names: Sequence[str], blocks: Blocks | None = None) -> None:
        self.trace, self.base, self.blocks = trace, base, blocks
        self.names = tuple(names)
        self.functions = [effect_functions(name) for name in self.names]
        self.layout = ParameterLayout(base.shape.size, self.names)
        self.slices = self.layout.slices
        self.size = self.layout.size
        contacts = RecordContacts(base, self.layout.shape.start, float(np.abs(trace.twist).max()))
        self._stages = RecordStages(trace, contacts, self.functions, self.slices, self.layout.shape)
        self._last: tuple[Array, Prediction] | None = None

    def __call__(self, parameters: Array) -> Prediction:
        """Torque and sensitivities for a parameter vector (size,): see `ParameterLayout`."""
        if self._last is None or not np.array_equal(self._last[0], parameters):
            self._last = np.array(parameters, float), self._predict(parameters)
        return self._last[1]

    def twist_beside_sensors(self, parameters: Array) -> Array:
        """(samples,) rad, twist of the contacts less that of the sensors."""
        _, contacts = self._stages.run(np.asarray(parameters, float).tolist())
        return np.asarray(contacts.contact) - self.trace.twist

    def _predict(self, parameters: Array) -> Prediction:
        (torque, gain), c = self._stages.run(np.asarray(parameters, float).tolist())
        # A torque that is read later is the torque of these angles less, to first order, what it has changed by since.
        # Its own rate shows that also where the elements move on by more than their distance between two samples.
        rate = -self.trace.torque_rate
        torque = torque.plus(Dual(parameters[DELAY] * rate, {DELAY: rate}))
        elastic, contact = np.asarray(c.elastic.value), np.asarray(c.contact)
        n = len(self.trace)
        blocks = self.blocks
        width = n if blocks is None else len(blocks.count)
        clearance = c.clearance if isinstance(c.clearance, np.ndarray) else np.full(width, float(c.clearance))
        gain = gain if isinstance(gain, np.ndarray) else np.ones(width)
        columns = np.zeros((self.size, width))
        for k, value in torque.tangent.items():
            columns[k] = blocks.mean(value) if blocks is not None and isinstance(value, np.ndarray) else value
        if blocks is None:
            contacts = Contacts(contact, clearance, _relative(gain))
            return Prediction(np.asarray(torque.value), columns.T, elastic, c.stiffness, contacts)
        mean = blocks.mean
        return Prediction(
            mean(np.asarray(torque.value)),
            columns.T,
            mean(elastic),
            mean(c.stiffness),
            Contacts(
                mean(contact),
                clearance if len(clearance) == width else mean(clearance),
                _relative(gain if len(gain) == width else mean(gain)),
            ),
        )


def _relative(gain: Array) -> Array:
    """A gain over its geometric mean."""
    log = np.log(np.maximum(gain, LEAST_GAIN))
    return np.exp(log - log.mean())
