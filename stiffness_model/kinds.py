"""The kinds of drives: what each provides to the functions that take any drive, and what it lacks.

A drawing states its kind (`kind = "catalogue"`; without that line it is a rolling element eccentric drive). Reader,
writer, `--set`, `simulate`, lookup, models, FMUs and commands look the kind up here, so that a further kind is one
entry of `KINDS` and the functions that the entry names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from .display import view
from .errors import InputError, expect, unknown_name
from .frozen_mapping import FrozenMapping

if TYPE_CHECKING:
    from .drawing.fields import Field, FurtherKey

ROLLING_ELEMENT_ECCENTRIC = "rolling element eccentric"
CYCLOIDAL = "cycloidal"
CATALOGUE = "catalogue"

CONTACT_FORCES = "contact forces"
"""What `Kind.lacks` may name: contact forces and load shares of population, lookup, model and FMU; ..."""
TOLERANCES = "tolerances"
"""... a scatter of virtual drives, without which the band is the mean; ..."""
INDIVIDUALS = "individual drives"
"""... one drive with its own deviations, as it turns (`--individual`); ..."""
SCALE_PICTURES = "pictures to scale and design studies"
"""... what `reefmu draw` draws and `reefmu explore` varies; ..."""
CONTACT_RESPONSES = "responses of single contacts"
"""... and what `reefmu plan` and the effects modulus_error and missing_ball are computed from."""


class AnyDrive(Protocol):
    """What drives of every kind have: name, kind, signed ratio from crank to output, greatest twist in use (rad)."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def ratio(self) -> float: ...
    @property
    def max_twist(self) -> float: ...


@dataclass(frozen=True)
class Kind:
    """One kind of drives. Functions are texts "module:function", imported when they are first called.

    name: as a drawing states it. noun: with its article, for messages. drive_fields: the mapping from names to `Field`
    that `--set` reads. read: (table of the drawing, its name in messages, **overriding fields) -> drive, where an
    unknown field raises `UnknownNameError`. write: drive -> table, which `read` reads back. simulate: (drive, twist,
    n_drives, seed, *, clearance, executor) -> population with twist, torque, crank_torque, `curve()` and `lines()`
    (further results in words) as `montecarlo.population.Population`. lookup: (drive, n_drives, seed, executor) ->
    `Lookup`; is_cached: whether it takes so long that it is kept in the cache. inherent_effects: drive -> values of the
    effects that a model of the drive has by default, by effect and parameter name. packaged: name -> table of a drive
    that comes with the package, or None; packaged_names: () -> the names of those drives. lacks: for what of
    `CONTACT_FORCES`, ... a drive of this kind does not have, the reason, as the end of a sentence. documentation: a
    paragraph on the fields, for docs/reference/drawing_format.md. section_notes: paragraphs on sections of the drawing.
    further_keys: the mapping from names to `FurtherKey`, of what is not a single value in a drawing. example: name of
    the packaged drive whose values a new drawing has.
    """

    name: str
    noun: str
    drive_fields: str
    read: str
    write: str
    simulate: str
    lookup: str
    example: str
    is_cached: bool = True
    inherent_effects: str = ""
    packaged: str = ""
    packaged_names: str = ""
    lacks: Mapping[str, str] = field(default_factory=lambda: FrozenMapping({}))
    documentation: str = ""
    section_notes: Mapping[str, str] = field(default_factory=lambda: FrozenMapping({}))
    further_keys: str = ""

    def call(self, function: str, *arguments: Any, **keywords: Any) -> Any:
        """The result of one of the functions by the name of its attribute, such as "read"."""
        return view(getattr(self, function))(*arguments, **keywords)

    @property
    def title(self) -> str:
        """The noun without its article, as it begins a description.

        >>> KINDS["cycloidal"].title
        'Cycloidal drive'
        """
        return self.noun.partition(" ")[2].capitalize()

    @property
    def fields(self) -> Mapping[str, Field]:
        """The declared fields of a drawing of this kind, by name."""
        return view(self.drive_fields)

    @property
    def keys_beside_fields(self) -> Mapping[str, FurtherKey]:
        """The keys of a drawing of this kind that are not single values, by name."""
        return view(self.further_keys) if self.further_keys else {}


_TOLERANCES = """\
A tolerance is that of a diameter: a width ("13 um"), a grade ("IT5", "ISO 492 Normal", "ISO 3290 G10"), a fit of ISO
286 ("14 H7", "h6") or limits ("0/-15 um"), at three standard deviations. The nominal diameter of a bore is that of the
element, that of the gear is the circle of the elements' centres. A fit and limits state the mean deviation, so that no
offset stands beside them; beside a width or a grade it is 0 by default, and for the cage such that a bore clears its
element by three standard deviations.
"""
_CATALOGUE_FIELDS = """\
A gear of which a data sheet is known; all its fields stand at the head of the file, k1 also as K1. The curve is given
by k1, t1, k2, t2 and k3, by k1 alone or k1, t1 and k2, by one `stiffness`, or by the points of a table: `twist` and
`torque`, two lists of texts with units. It is linear between its corners, to the digit; models round each corner over
1e-4 of the distance to the next one. `hysteresis_loss` is the width of the loop of the effect `hysteresis` that every
model contains, unless the caller gives that effect other values; likewise the table [efficiency] gives the parameters
of the effect `crank_friction`, fitted to its entries. `upper_limits` lists the fields whose value is an
upper limit, the table [sources] the sources of single fields, and the table [efficiency] has the lists `speed` and
`torque` and the rows `value`. `reefmu gears` lists the gears that come with the package.
"""

KINDS: Mapping[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind(
            name=ROLLING_ELEMENT_ECCENTRIC,
            noun="a rolling element eccentric drive",
            drive_fields="stiffness_model.drawing.drive:FIELDS",
            read="stiffness_model.io.ree_drawing:read_drawing",
            write="stiffness_model.io.ree_drawing:write_drawing",
            simulate="stiffness_model.montecarlo.population:simulate_drawing",
            lookup="stiffness_model.lookup.build_lookup:build_drawing_lookup",
            inherent_effects="stiffness_model.ratings.efficiency:contact_friction",
            example="workshop",
            section_notes={"tolerances": _TOLERANCES},
        ),
        Kind(
            name=CYCLOIDAL,
            noun="a cycloidal drive",
            drive_fields="stiffness_model.cycloidal.cycloidal_drive:CYCLOIDAL_FIELDS",
            read="stiffness_model.cycloidal.cycloidal_drawing:read_cycloidal",
            write="stiffness_model.cycloidal.cycloidal_drawing:write_cycloidal",
            simulate="stiffness_model.cycloidal.cycloidal_population:simulate_cycloidal",
            lookup="stiffness_model.cycloidal.cycloidal_lookup:cycloidal_lookup",
            example="printed_cycloidal",
            lacks={
                INDIVIDUALS: "its individuals are in `stiffness_model.cycloidal.gear_turn`, not yet in models",
                SCALE_PICTURES: "so far these are made of rolling element eccentric drives only",
                CONTACT_RESPONSES: "its contacts act together in one equilibrium of the disc",
            },
        ),
        Kind(
            name=CATALOGUE,
            noun="a catalogue gear",
            drive_fields="stiffness_model.catalog.catalogue_drive:FIELDS",
            read="stiffness_model.catalog.catalogue_toml:read_catalogue",
            write="stiffness_model.catalog.catalogue_toml:write_catalogue",
            simulate="stiffness_model.catalog.catalogue_population:simulate_catalogue",
            lookup="stiffness_model.catalog.catalogue_population:catalogue_lookup",
            example="CHA-40A-50",
            is_cached=False,
            inherent_effects="stiffness_model.catalog.catalogue_population:catalogue_effects",
            packaged="stiffness_model.catalog.catalogue_toml:packaged_gear",
            packaged_names="stiffness_model.catalog.catalogue_toml:packaged_gear_names",
            lacks={
                CONTACT_FORCES: "its data sheet states nothing of contacts",
                TOLERANCES: "its data sheet states one curve",
                INDIVIDUALS: "its data sheet states one curve",
                SCALE_PICTURES: "its data sheet states no dimensions",
                CONTACT_RESPONSES: "its data sheet states nothing of contacts",
            },
            documentation=_CATALOGUE_FIELDS,
            further_keys="stiffness_model.catalog.catalogue_toml:FURTHER_KEYS",
        ),
    )
}
"""Every kind by its name."""


def kind_of_table(table: Mapping[str, Any], where: str) -> Kind:
    """The kind that a drawing states; a rolling element eccentric drive if it states none.

    Raises `InputError` for a kind that is no text, `UnknownNameError` for an unknown one.

    >>> kind_of_table({"kind": "rolling element"}, "mine.toml")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.UnknownNameError: mine.toml: unknown kind 'rolling element'; did you mean 'rolling element \
eccentric'?
    """
    name = table.get("kind", ROLLING_ELEMENT_ECCENTRIC)
    expect(isinstance(name, str), "the kind of the drive as a text", name, f"{where}: kind")
    if name not in KINDS:
        raise unknown_name("kind", name, KINDS, where)
    return KINDS[name]


def expect_kind(table: Mapping[str, Any], name: str, where: str) -> None:
    """Raise `InputError` for a drawing of another kind than `name`, as `kind_of_table` for one of no kind."""
    found = kind_of_table(table, where).name
    if found != name:
        raise InputError(f"{where}: expected kind {name!r} here, got {found!r}")


def kind_of(drive: AnyDrive) -> Kind:
    """The kind of a drive."""
    return KINDS[drive.kind]


def is_drive(value: object) -> bool:
    """Whether a value is a drive of some kind."""
    return isinstance(getattr(value, "kind", None), str) and getattr(value, "kind", None) in KINDS


def lacking(drive: AnyDrive, what: str) -> str:
    """One line on why a drive does not have `what` of `CONTACT_FORCES`, ...; empty if it has it."""
    kind = kind_of(drive)
    return f"{drive.name} is {kind.noun} without {what}: {kind.lacks[what]}" if what in kind.lacks else ""


def expect_has(drive: AnyDrive, what: str, where: str) -> None:
    """Raise `InputError` if the drive's kind lacks `what`. where: the command or function that needs it."""
    if reason := lacking(drive, what):
        raise InputError(f"{where}: {reason}")
