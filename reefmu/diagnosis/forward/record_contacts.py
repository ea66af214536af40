"""The stage `contacts` over a whole trace: base curve, missing elements and modulus, in series with a compliance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stiffness_model.lookup.element_table import FADE_HALF_WIDTH, ElementTable
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import locate, slope_weights, weights

from .base_curve import BaseCurve
from .effect_functions import Dual, Tangent, accumulate, is_zero, scaled
from .elastic import SplineTable, across
from .vectorised import Number

NEWTON_STEPS = 12
"""Most Newton steps for the twist of the contacts in series with a compliance, and the relative step at which they
stop; chosen by judgement: the search converges quadratically."""
NEWTON_TOLERANCE = 1e-9


class Coefficients(NamedTuple):
    """Variable r: compliance in series with the contacts, rad/(N.m), None without one; missing shares of elements;
    relative error of the modulus; shape (n_shape,) of the base curve."""

    compliance: Dual | None
    missing: tuple[Dual, ...]
    modulus: Dual
    shape: Array


class ContactPoint(NamedTuple):
    """Variable q: twist of the contacts and all compliances, rad, and the offset in it that the contacts do not see;
    clearance, m; positions of the missing elements, rad."""

    twist: Dual
    offset: Dual
    clearance: Dual
    positions: tuple[Dual, ...]


class ContactOutputs(NamedTuple):
    """Variable c: elastic torque, N.m; its derivatives by the twist, (n,) N.m/rad, and by the torque that the base
    curve has at the twist of the contacts; that twist, (n,) rad; clearance beyond the drawing's, m."""

    elastic: Dual
    stiffness: Array
    gain: Number
    contact: Array
    clearance: Number


class RecordContacts:
    """The contacts of a base curve. first: index of its first shape parameter; reach: greatest twist, rad."""

    def __init__(self, base: BaseCurve, first: int, reach: float) -> None:
        self.base, self.first, self.reach = base, first, reach
        self._solution: Array | None = None

    def __call__(self, q: ContactPoint, r: Coefficients) -> ContactOutputs:
        """The contacts in equilibrium with the compliance in series, with exact sensitivities."""
        clearance, scale = q.clearance, self._scale(r.modulus)[0]
        if r.compliance is None:
            at = np.asarray(q.twist.value)
            torque, stiffness = self._contacts(at, q.twist.tangent, q, r)
            return ContactOutputs(torque, stiffness, scale, at, clearance.value)
        compliance, at = r.compliance, np.asarray(q.twist.value - q.offset.value)
        if not is_zero(compliance.value):
            # From the last solution, which a fit or a search for states changes little, fewer steps are needed.
            at = at if self._solution is None else self._solution
            self._solution = None
            for _ in range(NEWTON_STEPS):
                torque, stiffness = self._contacts(at, None, q, r)
                gap = at + compliance.value * torque.value + q.offset.value - q.twist.value
                step = gap / (1 + compliance.value * stiffness)
                at = at - step
                if np.abs(step).max() <= NEWTON_TOLERANCE * self.reach:
                    self._solution = at
                    break
        torque, stiffness = self._contacts(at, {}, q, r)
        # dT = dT|contact + K (d twist - d offset - T dC - C dT)
        softening = 1 / (1 + compliance.value * stiffness)
        tangent = dict(torque.tangent)
        accumulate(tangent, q.twist.tangent, stiffness)
        accumulate(tangent, q.offset.tangent, -stiffness)
        accumulate(tangent, compliance.tangent, -stiffness * torque.value)
        elastic = Dual(torque.value, scaled(tangent, softening))
        return ContactOutputs(elastic, stiffness * softening, scale * softening, at, clearance.value)

    def _contacts(
        self, at: Array, twist_tangent: Tangent | None, q: ContactPoint, r: Coefficients
    ) -> tuple[Dual, Array]:
        """Torque and stiffness at a twist (n,) of the contacts themselves; no tangents if twist_tangent is None."""
        clearance = q.clearance
        moves = twist_tangent is not None and bool(clearance.tangent)
        torque, stiffness, by_clearance, by_shape = self.base.elastic.evaluate(
            at, clearance.value, r.shape, by_clearance=moves
        )
        elements: list[tuple[Dual, Dual, Array, Array]] = []
        for missing, position in zip(r.missing, q.positions, strict=True):
            assert self.base.element is not None
            t, k, c, b = element_torque(self.base.element, at, clearance.value, position.value, by_clearance=moves)
            elements.append((missing, position, t, b))
            torque, stiffness = torque - missing.value * t, stiffness - missing.value * k
            by_clearance = by_clearance - missing.value * c
        scale, scale_slope = self._scale(r.modulus)
        tangent: Tangent = {}
        if twist_tangent is not None:
            accumulate(tangent, twist_tangent, scale * stiffness)
            accumulate(tangent, clearance.tangent, scale * by_clearance)
            accumulate(tangent, r.modulus.tangent, scale_slope * torque)
            accumulate(tangent, self._by_shape(by_shape, scale))
            for missing, position, t, b in elements:
                accumulate(tangent, missing.tangent, -scale * t)
                accumulate(tangent, position.tangent, -scale * missing.value * b)
        return Dual(scale * torque, tangent), scale * stiffness

    def _by_shape(self, columns: Sequence[Array], scale: float) -> Tangent:
        return {self.first + k: scale * column for k, column in enumerate(columns)}

    def _scale(self, modulus: Dual) -> tuple[float, float]:
        """Factor of the torque for another modulus, and its slope by the error (complex-step derivative)."""
        if self.base.modulus is None or not modulus.tangent:
            return 1.0, 0.0
        error = float(modulus.value)
        scale = float(self.base.modulus.scale(error))
        return scale, float(np.imag(self.base.modulus.scale(error + 1e-30j)) / 1e-30)


def element_torque(
    table: ElementTable, twist: Array, clearance: Number, position: Number, *, by_clearance: bool = True
) -> tuple[Array, Array, Array, Array]:
    """Torque, N.m, and its derivatives by twist, clearance and position, (n,) each, as `ElementTable.evaluate`.

    twist: (n,) rad; clearance: m; position: rad, of the element; numbers or (n,). Only where the element carries load
    anything is evaluated, and the derivative by a single clearance only if `by_clearance`; else it is 0.
    """
    beta = np.broadcast_to(np.asarray(position, float), twist.shape)
    beta = beta - 2 * np.pi * np.floor(beta / (2 * np.pi) + 0.5)
    loaded = np.flatnonzero(np.abs(beta) < table.limit + FADE_HALF_WIDTH)
    side = np.where(beta[loaded] < 0, -1.0, 1.0)
    distance = np.abs(beta[loaded])
    if isinstance(clearance, np.ndarray) and clearance.ndim:
        value, by_twist, slope_by_clearance, by_position = _element_splines(
            table, side * twist[loaded], clearance[loaded], distance
        )
    else:
        cell, g = (v[0] for v in locate(table.clearance, np.array([float(clearance)])))
        held = float(np.clip(g, 0.0, 1.0))
        strip = np.moveaxis(table.coefficients[:, int(cell) : int(cell) + 4], 1, 2)
        axes = (table.twist, table.position)
        value, by_twist, by_position = SplineTable(axes, strip @ np.array(weights(held, held), float)).evaluate(
            side * twist[loaded], distance
        )
        slope_by_clearance: Number = 0.0
        if by_clearance:
            slope = np.array(slope_weights(held), float) / table.clearance.step * (0 <= g <= 1)
            slope_by_clearance = SplineTable(axes, strip @ slope).evaluate(side * twist[loaded], distance)[0]
    fade = (table.limit - distance) / (2 * FADE_HALF_WIDTH) + 0.5
    inside = np.clip(fade, 0.0, 1.0)
    inside_slope = np.where((fade > 0) & (fade < 1), -1 / (2 * FADE_HALF_WIDTH), 0.0)
    results = np.zeros((4, len(twist)))
    results[:, loaded] = (
        side * inside * value,
        inside * by_twist,
        side * inside * slope_by_clearance,
        inside * by_position + inside_slope * value,
    )
    return results[0], results[1], results[2], results[3]


def _element_splines(
    table: ElementTable, twist: Array, clearance: Array, distance: Array
) -> tuple[Array, Array, Array, Array]:
    """Splines of one element and their derivatives by twist, clearance and distance, (n,) each, at arguments (n,)."""
    i, f = locate(table.twist, twist)
    k, h = locate(table.position, distance)
    j, along_clearance, slope_clearance = across(table.clearance, clearance)
    inside_f, inside_h = np.clip(f, 0.0, 1.0), np.clip(h, 0.0, 1.0)
    along_twist, slope_twist = weights(f, inside_f), slope_weights(inside_f)
    along_distance, slope_distance = weights(h, inside_h), slope_weights(inside_h)
    flat, (_, n_clearance, n_distance) = table.coefficients.ravel(), table.coefficients.shape
    value, by_twist, by_clearance, by_distance = np.zeros((4, len(twist)))
    for a in range(4):
        layer, layer_by_clearance, layer_by_distance = np.zeros((3, len(twist)))
        for b in range(4):
            at = ((i + a) * n_clearance + j + b) * n_distance + k
            cells = [np.take(flat, at + d, mode="clip") for d in range(4)]
            row = sum(along_distance[d] * cells[d] for d in range(4))
            layer += along_clearance[b] * row
            layer_by_clearance += slope_clearance[b] * row
            layer_by_distance += along_clearance[b] * sum(slope_distance[d] * cells[d] for d in range(4))
        value += along_twist[a] * layer
        by_twist += slope_twist[a] * layer
        by_clearance += along_twist[a] * layer_by_clearance
        by_distance += along_twist[a] * layer_by_distance
    return value, by_twist / table.twist.step, by_clearance, by_distance / table.position.step
