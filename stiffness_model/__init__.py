"""Contact model of the stiffness of rolling element eccentric (REE) drives.

From a drawing to twist-over-torque, stiffness, backlash, contact forces and load shares of many virtual drives.
After Fritsch et al., "Static Modeling of the Stiffness and Contact Forces of Rolling Element Eccentric Drives
for Use in Robotic Drive Systems" (the paper; equation numbers are its).

    drawing -> contact -> equilibrium -> montecarlo -> lookup | ratings | rotation | explore

* `drawing`: one drive as drawn, its tolerances, the virtual drives drawn from it; `io` reads and writes it.
* `geometry`, `elasticity`, `contact`: the path of the elements, two bodies pressed together, every element's contacts.
* `equilibrium`: forces and displacements of every element; `montecarlo`: thousands of virtual drives and their curve.
* `lookup`: the mean drive as tables; `ratings`: pressure, safety, life, losses; `rotation`: one drive as it turns;
  `explore`: design studies; `catalog`: published gears; `cycloidal`: pin-cycloid reducers; `plotting`: pictures.
* `kinds`: the kinds of drives and what each provides; `transmission_losses`: losses as friction at the crank;
  `numerics`, `memory`, `units`, `errors`, `frozen_mapping`: used by all; `display`: reprs, notebook tables, DataFrames;
  `lazy_names`: names imported on first use; `version`: of the distribution; `turning`: an alias of `rotation`.

Names are imported on first use: a drawing, or an FMU at run time, needs no solver and loads no SciPy.

>>> import numpy as np
>>> from stiffness_model import ARCMIN, load_drive, simulate
>>> drive = load_drive("drive_1")
>>> curve = simulate(drive, np.linspace(0, 8, 17) * ARCMIN, n_drives=100).curve()
>>> bool(170 < curve.torque_at(6 * ARCMIN) < 195)
True
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .lazy_names import lazy_names

if TYPE_CHECKING:
    from .drawing.drive import Drive
    from .drawing.material_library import MATERIALS
    from .drawing.materials import Material
    from .drawing.tolerances import Tolerance
    from .errors import DoesNotFitWarning, InputError, NotConvergedWarning, UnknownNameError
    from .io.drawing_toml import drive_from_dict, drive_to_dict, load_drive, presets, save_drive
    from .montecarlo.population import Population, simulate
    from .montecarlo.twist_torque_curve import TwistTorqueCurve
    from .ratings.pressure import Pressures, contact_pressures
    from .units import ARCMIN

__version__: str
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

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".montecarlo.twist_torque_curve": ("TwistTorqueCurve",),
        ".io.drawing_toml": ("drive_from_dict", "drive_to_dict", "load_drive", "presets", "save_drive"),
        ".drawing.drive": ("Drive",),
        ".errors": ("DoesNotFitWarning", "InputError", "NotConvergedWarning", "UnknownNameError"),
        ".drawing.material_library": ("MATERIALS",),
        ".drawing.materials": ("Material",),
        ".montecarlo.population": ("Population", "simulate"),
        ".ratings.pressure": ("Pressures", "contact_pressures"),
        ".drawing.tolerances": ("Tolerance",),
        ".units": ("ARCMIN",),
        ".version": ("__version__",),
    },
)
