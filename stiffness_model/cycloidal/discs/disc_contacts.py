"""The contacts of discs with pins, output rollers and crank bearings, ready for the equilibrium.

A row is one disc of one drive. Its reference is the disc without load and deviations, in contact with all pins and
rollers, at the drive's crank angle; the output is locked there, and the crank turns by ratio theta for the twist theta.
The pose (x, y, s, o) of a disc consists of the displacement x, y of its centre, m, its rotation psi as s = R psi, m,
and a rotation -gamma of the output (of an elastic housing, for example) as o = R gamma, m; R is `DiscContacts.radius`.
Components are those of the frame of the reference (`pin_trochoid`). The crank's turn may be large (some ten degrees);
the poses are small, for contacts keep the disc near the reference: relative displacements are linear in the pose.

With the relative displacement (n, t) along the common normal (positive: apart) and the tangent, the gap is

    g = c + F(n, t),   F = (sqrt((1 + k n)^2 + (k t)^2) - 1)/k,

the distance from a point to a circle of curvature k. For a pin, the point is its centre and the circle osculates the
path of the pins' centres; the error is of third order in t. For a roller of radius r in a hole of radius r + e + c,
the centres lie e apart without load, and with k = -1/e the equation is exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...elasticity.hertz import line_stiffness
from ...numerics.arrays import Array, Index
from ..cycloidal_drive import CycloidalDrive
from ..part_deviations import PartDeviations


@dataclass(frozen=True, eq=False)
class DiscContacts:
    """Contacts of D rows, each with C = pins + rollers contacts, the pins first.

    normal, tangent: (D, 4, C), derivatives of n and t by the pose; gap: c, (D, 1, C) m; curvature: k, (D, 1, C) 1/m;
    stiffness: K of F = K d^(10/9), (D, 1, C); series: compliance of the bodies behind each contact, (D, 1, C) m/N.
    bearing_stiffness: (D, 1) N/m, infinite for rigid bearings; bearing_clearance, eccentricity, radius, pins and ratio:
    of the drawing.
    """

    normal: Array
    tangent: Array
    gap: Array
    curvature: Array
    stiffness: Array
    series: Array
    bearing_stiffness: Array
    bearing_clearance: float
    eccentricity: float
    radius: float
    pins: int
    ratio: float

    def __len__(self) -> int:
        return len(self.gap)

    def __getitem__(self, rows: Index | slice) -> DiscContacts:
        """Some of the rows, (k,) indices or a slice."""
        return replace(self, **{name: getattr(self, name)[rows] for name in _ROWS})

    @property
    def is_rigid(self) -> bool:
        """Whether the bearings are rigid, so that the discs' centres follow the crank."""
        return bool(np.isinf(self.bearing_stiffness[0, 0]))

    def centre(self, twist: Array) -> Array:
        """Displacement of the eccentric's centre, m, (..., 2), at twists (...), rad."""
        turn = self.ratio * twist
        return self.eccentricity * np.stack([np.cos(turn) - 1.0, np.sin(turn)], -1)


_ROWS = ("normal", "tangent", "gap", "curvature", "stiffness", "series", "bearing_stiffness")


def build_disc_contacts(drive: CycloidalDrive, deviations: PartDeviations, clearance: float = 0.0) -> DiscContacts:
    """The contacts of all discs of n drives: n times `discs` rows, the discs of a drive together.

    clearance: m, added to the profile's clearance in all drives.
    """
    disc = 2 * np.pi * np.arange(drive.discs) / drive.discs
    phase = deviations.crank_angle[:, None] + disc
    pins = _pin_contacts(drive, deviations, phase, clearance)
    rollers = _roller_contacts(drive, deviations, phase)
    normal, tangent, gap, curvature, stiffness = (np.concatenate(pair, -1) for pair in zip(pins, rollers, strict=True))
    rows = phase.size
    bodies = np.repeat([drive.ring_stiffness, drive.roller_stiffness], [drive.pins, drive.output_rollers])
    factor = np.repeat(deviations.stiffness, drive.discs)[:, None]
    return DiscContacts(
        normal=normal.reshape(rows, 4, -1),
        tangent=tangent.reshape(rows, 4, -1),
        gap=gap.reshape(rows, 1, -1),
        curvature=curvature.reshape(rows, 1, -1),
        stiffness=stiffness.reshape(rows, 1, -1),
        series=1 / (bodies * factor)[:, None],
        bearing_stiffness=drive.bearing_stiffness * factor,
        bearing_clearance=drive.bearing_clearance,
        eccentricity=drive.eccentricity,
        radius=drive.pin_circle_radius,
        pins=drive.pins,
        ratio=drive.ratio,
    )


_Contacts = tuple[Array, Array, Array, Array, Array]
"""Normal and tangent, (n, M, 4, c), gap, curvature and stiffness, (n, M, c)."""


def _pin_contacts(drive: CycloidalDrive, deviations: PartDeviations, phase: Array, clearance: float) -> _Contacts:
    """Contacts with the pins; a disc that moves along the pin's push opens the gap."""
    place = 2 * np.pi * np.arange(drive.pins) / drive.pins
    alpha = place - phase[..., None]
    nominal = drive.path.contacts(alpha)
    push, tangent = nominal.push, -1j * nominal.push
    zero = np.zeros_like(alpha)
    levers = [(np.conj(nominal.centre) * along).imag / drive.pin_circle_radius for along in (push, tangent)]
    # The flank whose lobe ends in the valleys on both sides; valleys lie where alpha is a multiple of 2 pi.
    lobe = np.floor((drive.lobes * place + phase[..., None]) / (2 * np.pi)).astype(np.intp) % drive.lobes
    form = np.take_along_axis(deviations.lobe, lobe, axis=-1)
    radial, tangential = deviations.pin_position[:, None, :, 0], deviations.pin_position[:, None, :, 1]
    moved = (radial + 1j * tangential) * np.exp(1j * alpha)
    gap = (
        drive.profile_clearance
        + clearance
        + drive.profile_offset * nominal.radial
        - deviations.pin[:, None, :]
        - form
        - (push * np.conj(moved)).real
    )
    return (
        np.stack([push.real, push.imag, levers[0], zero], -2),
        np.stack([tangent.real, tangent.imag, levers[1], zero], -2),
        gap,
        nominal.curvature,
        _stiffness(drive, "ring", deviations.stiffness, alpha),
    )


def _roller_contacts(drive: CycloidalDrive, deviations: PartDeviations, phase: Array) -> _Contacts:
    """Contacts of rollers and holes: every roller lies on the side of its hole opposite to the eccentricity."""
    place = 2 * np.pi * np.arange(drive.output_rollers) / drive.output_rollers
    # Output and hole turn with the disc, by -crank angle/lobes.
    turned = place - deviations.crank_angle[:, None] / drive.lobes
    centre = drive.roller_circle_radius * np.exp(1j * (turned[:, None, :] - phase[..., None]))
    one, zero = np.ones(centre.shape), np.zeros(centre.shape)
    across, along = centre.imag / drive.pin_circle_radius, centre.real / drive.pin_circle_radius
    place_error = deviations.roller_position[:, None] - deviations.hole_position
    moved = (place_error[..., 0] + 1j * place_error[..., 1]) * centre / drive.roller_circle_radius
    gap = drive.hole_clearance + deviations.hole - deviations.roller[:, None, :] + moved.real
    return (
        np.stack([-one, zero, across, across], -2),
        np.stack([zero, -one, -along, -along], -2),
        gap,
        -one / drive.eccentricity,
        _stiffness(drive, "roller", deviations.stiffness, centre),
    )


def _stiffness(drive: CycloidalDrive, part: str, factor: Array, like: Array) -> Array:
    """K of each contact of a disc with a part, of the shape of `like`, with the moduli times `factor`, (n,)."""
    compliance = (drive.materials["disc"].compliance + drive.materials[part].compliance) / factor
    return np.broadcast_to(line_stiffness(compliance, drive.disc_thickness)[:, None, None], like.shape)
