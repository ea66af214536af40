"""The stage `contacts`: the table, an individual's contacts or a curve, in series with a compliance.

A missing element's torque is taken away from the table's, the sum is scaled for another modulus, and the twist of the
contacts themselves is found by Newton steps where a compliance is in series with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

NEWTON_STEPS = 8
"""Newton steps for the twist of the contacts in series with a compliance. The residual of eight is below 1e-12
of the twist for a compliance up to three times the contacts' own (a test holds it)."""
NEWTON_TOLERANCE = 1e-10
"""rad: convergence is quadratic, so that after a step of this size the next would be below 1e-15, which is rounding."""


@dataclass(frozen=True)
class ContactEquilibrium:
    """The parts of the stage `contacts`.

    table: (twist, clearance, band, or an individual's output angle) -> (torque, stiffness, max contact force, load
    share, in range); element: (twist, clearance, position) -> (torque, stiffness) of one element, or None. compliant,
    scaled: whether a compliance is in series, and whether the modulus may differ from the drawing's. point,
    coefficients: names of the entries of q and r.
    """

    table: ca.Function
    element: ca.Function | None
    compliant: bool
    scaled: bool
    point: tuple[str, ...]
    coefficients: tuple[str, ...]

    @cached_property
    def function(self) -> ca.Function:
        """The stage: (q, r) -> c."""
        q, r = ca.MX.sym("q", len(self.point)), ca.MX.sym("r", len(self.coefficients))
        target, compliance = self._entry(q, "target"), self._entry(r, "compliance")
        if not self.compliant:
            return ca.Function("contacts", [q, r], [ca.vertcat(*self._contacts(target, q, r))])
        twist, correction = target, ca.MX(1)
        for _ in range(NEWTON_STEPS):
            # A branch that is not taken is not evaluated: most searches converge in two or three steps.
            twist, correction = self._newton(ca.fabs(correction) > NEWTON_TOLERANCE, twist, correction, q, r)
        torque, stiffness, *others = self._contacts(twist, q, r)
        # The remaining residual is far below rounding, but its derivatives are those of the converged twist.
        torque -= stiffness * (twist + compliance * torque - target) / (1 + compliance * stiffness)
        return ca.Function("contacts", [q, r], [ca.vertcat(torque, stiffness / (1 + compliance * stiffness), *others)])

    @cached_property
    def _newton(self) -> ca.Function:
        """(condition, twist of the contacts, last correction, q, r) -> the next two, or the same two again."""
        twist, correction = ca.MX.sym("twist"), ca.MX.sym("correction")
        q, r = ca.MX.sym("q", len(self.point)), ca.MX.sym("r", len(self.coefficients))
        target, compliance = self._entry(q, "target"), self._entry(r, "compliance")
        torque, stiffness, *_ = self._contacts(twist, q, r)
        step = (target - twist - compliance * torque) / (1 + compliance * stiffness)
        arguments = [twist, correction, q, r]
        return ca.Function.if_else(
            "newton",
            ca.Function("step", arguments, [twist + step, step]),
            ca.Function("stay", arguments, [twist, correction]),
        )

    @cached_property
    def _contacts(self) -> ca.Function:
        """(twist of the contacts themselves, q, r) -> contact outputs; a function, so that its code appears once."""
        twist = ca.MX.sym("twist")
        q, r = ca.MX.sym("q", len(self.point)), ca.MX.sym("r", len(self.coefficients))
        clearance = self._entry(q, "clearance")
        place = self._entry(q, "angle") if "angle" in self.point else self._entry(r, "band")
        torque, stiffness, force, share, in_range = self.table(twist, clearance, place)
        if self.element is not None:
            for missing, position in zip(self._entries(r, "missing"), self._entries(q, "position"), strict=True):
                lost, lost_stiffness = self.element(twist, clearance, position)
                torque, stiffness = torque - missing * lost, stiffness - missing * lost_stiffness
        if self.scaled:
            scale = self._entry(r, "scale")
            torque, stiffness, force = scale * torque, scale * stiffness, scale * force
        return ca.Function("contact", [twist, q, r], [torque, stiffness, force, share, in_range])

    def _entry(self, vector: ca.MX, name: str) -> ca.MX:
        names = self.point if name in self.point else self.coefficients
        return vector[names.index(name)]

    def _entries(self, vector: ca.MX, name: str) -> Sequence[ca.MX]:
        names = self.point if name in self.point else self.coefficients
        return [vector[k] for k, other in enumerate(names) if other.partition("_")[0] == name]
