"""The FMU as a file: a zip archive, written whole or not at all, the same bytes for the same content."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from stiffness_model.errors import InputError, expect
from stiffness_model.files import whole_file

from .description import TOOL

DESCRIPTION = "modelDescription.xml"
SCRIPT_NAME = "resources/slavemodule.txt"
"""Where pythonfmu's binary reads which script to load."""


@dataclass(frozen=True)
class FmuFile:
    """What a file says of itself. kind and backend are empty for an FMU that another tool made."""

    path: Path
    fmi_version: str
    generation_tool: str
    guid: str
    model_identifier: str
    kind: str
    backend: str
    members: tuple[str, ...]


def write_archive(path: str | os.PathLike[str], members: Mapping[str, bytes], when: datetime) -> Path:
    """Write `members` (name in the archive -> content) to `path`, dated `when` throughout.

    The archive grows under a temporary name beside `path` and then takes its place in one step, so a reader
    never meets half of it and a failure leaves nothing. Errors: `InputError` if the folder is missing or
    cannot be written.
    """
    target = Path(path)
    # Zip knows no dates before 1980 and counts in two seconds.
    stamp = max(when.astimezone(UTC), datetime(1980, 1, 1, tzinfo=UTC))
    date = (stamp.year, stamp.month, stamp.day, stamp.hour, stamp.minute, stamp.second // 2 * 2)
    try:
        with whole_file(target) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for member in sorted(members):
                info = zipfile.ZipInfo(member, date)
                info.create_system = 3  # Unix, so that the mode below means the same wherever it is written
                info.external_attr = 0o100644 << 16
                archive.writestr(info, members[member], zipfile.ZIP_DEFLATED, 9)
    except OSError as error:
        came = error.strerror or error
        raise InputError(f"{target}: expected a file that can be written, got {came}") from None
    return target


def read_archive(path: str | os.PathLike[str]) -> FmuFile:
    """Look at an FMU without running it.

    Errors: `InputError` for a missing file, one that is no zip archive or is cut off or damaged, and one
    without a readable modelDescription.xml.
    """
    source = Path(path)
    where = str(source)
    expect(source.exists(), "an FMU file", "no such file", where)
    expect(source.is_file(), "an FMU file", "a folder", where)
    try:
        with zipfile.ZipFile(source) as archive:
            damaged = archive.testzip()
            expect(damaged is None, "a whole zip archive", f"damaged content in {damaged}", where)
            members = tuple(archive.namelist())
            expect(DESCRIPTION in members, f"an FMU with {DESCRIPTION}", "a zip archive without it", where)
            root = ElementTree.fromstring(archive.read(DESCRIPTION))
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        size = source.stat().st_size
        raise InputError(f"{where}: expected an FMU (a whole zip archive), got {size} bytes that are none: "
                         f"{error}") from None
    except ElementTree.ParseError as error:
        raise InputError(f"{where}: expected XML in {DESCRIPTION}, got {error}") from None
    except OSError as error:
        raise InputError(f"{where}: expected a readable file, got {error.strerror or error}") from None
    expect(root.tag == "fmiModelDescription", f"fmiModelDescription in {DESCRIPTION}", root.tag, where)
    simulation = root.find("CoSimulation")
    marks = root.find(f"VendorAnnotations/Tool[@name='{TOOL}']/fmu")
    if marks is None:
        marks = root.find(f"Annotations/Annotation[@type='{TOOL}']/fmu")  # FMI 3.0
    return FmuFile(
        path=source,
        fmi_version=root.get("fmiVersion", ""),
        generation_tool=root.get("generationTool", ""),
        guid=root.get("guid") or root.get("instantiationToken", ""),
        model_identifier="" if simulation is None else simulation.get("modelIdentifier", ""),
        kind="" if marks is None else marks.get("kind", ""),
        backend="" if marks is None else marks.get("backend", ""),
        members=members,
    )
