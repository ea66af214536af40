"""Contact model of the stiffness of rolling element eccentric (REE) drives.

From a drawing to twist-over-torque, stiffness, backlash, contact forces and load shares of many virtual drives.
After Fritsch et al., "Static Modeling of the Stiffness and Contact Forces of Rolling Element Eccentric Drives
for Use in Robotic Drive Systems" (the paper; equation numbers are its).

>>> import numpy as np
>>> drive = load_drive("drive_1")
>>> curve = simulate(drive, np.linspace(0, 8, 17) * ARCMIN, n_drives=100).curve()
>>> bool(170 < curve.torque_at(6 * ARCMIN) < 195)
True
"""

from .curve import TwistTorqueCurve
from .drawing_file import drive_from_dict, drive_to_dict, load_drive, presets, save_drive
from .drive import Drive
from .errors import DoesNotFitWarning, InputError, NotConvergedWarning, UnknownNameError
from .materials import MATERIALS, Material
from .population import Population, simulate
from .pressure import Pressures, contact_pressures
from .tolerances import Tolerance
from .units import ARCMIN

__all__ = [
    "ARCMIN",
    "DoesNotFitWarning",
    "Drive",
    "InputError",
    "MATERIALS",
    "Material",
    "NotConvergedWarning",
    "Population",
    "Pressures",
    "Tolerance",
    "TwistTorqueCurve",
    "UnknownNameError",
    "contact_pressures",
    "drive_from_dict",
    "drive_to_dict",
    "load_drive",
    "presets",
    "save_drive",
    "simulate",
]
