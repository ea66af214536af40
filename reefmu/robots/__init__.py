"""The drive in a robot simulator: a MuJoCo plugin from the same C as the native FMU.

* `plugin_sources`: the C files; `mujoco_library`: the installed MuJoCo, against which they are compiled.
* `twist_inertia`: the inertia that makes the stiff spring stable at the simulator's time step.
* `mjcf`: the model of one joint as an MJCF file; `plugin_export`: all files of an export.
* `spec`: the drive in a joint of an existing model, by MuJoCo's `MjSpec`.

MuJoCo itself is imported only where a plugin is loaded or a model is edited.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stiffness_model.lazy_names import lazy_names

if TYPE_CHECKING:
    from .plugin_export import export_mujoco
    from .spec import add_drive, load_plugin, settle
    from .twist_inertia import largest_time_step, twist_armature

__all__ = ["add_drive", "export_mujoco", "largest_time_step", "load_plugin", "settle", "twist_armature"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        ".plugin_export": ("export_mujoco",),
        ".spec": ("add_drive", "load_plugin", "settle"),
        ".twist_inertia": ("largest_time_step", "twist_armature"),
    },
)
