"""The FMU as a zip archive, written atomically, with the same bytes for the same content."""

from __future__ import annotations

import io
import os
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

from stiffness_model.errors import InputError, expect
from stiffness_model.io.atomic_files import atomic_file

from .description import TOOL

DESCRIPTION = "modelDescription.xml"
MAX_MEMBERS, MAX_BYTES, MAX_TEXT_BYTES = 1000, 1 << 28, 1 << 24
"""Limits of an FMU that is read: members, bytes unpacked (256 MiB; those of this package have at most 4 MiB), and bytes
of one member that is read as a whole. Chosen by judgement, against archives that exhaust the memory."""
_MAX_DEPTH = 100
"""Greatest depth of nested elements; a description has 5, and other XML parsers stop at 256."""
SCRIPT_NAME = "resources/slavemodule.txt"
"""The member that names the script which pythonfmu's binary loads."""


@dataclass(frozen=True)
class FmuFile:
    """Key data of an FMU. kind and backend are empty for an FMU of another tool."""

    path: Path
    fmi_version: str
    generation_tool: str
    guid: str
    model_identifier: str
    kind: str
    backend: str
    members: tuple[str, ...]


def write_archive(path: str | os.PathLike[str], members: Mapping[str, bytes], date: datetime) -> Path:
    """Write `members` (name in the archive -> content) to `path`, all with the date `date`.

    The archive is written to a temporary file beside `path` and then replaces it in one step, so that a reader never
    sees an incomplete file. Errors: `InputError` if the folder is missing or cannot be written.
    """
    target = Path(path)
    # Zip has no dates before 1980 and a resolution of two seconds.
    stamp = max(date.astimezone(UTC), datetime(1980, 1, 1, tzinfo=UTC))
    date_time = (stamp.year, stamp.month, stamp.day, stamp.hour, stamp.minute, stamp.second // 2 * 2)
    try:
        with atomic_file(target) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for member in sorted(members):
                info = zipfile.ZipInfo(member, date_time)
                info.create_system = 3  # Unix, on every system, so that the mode below has a meaning
                info.external_attr = 0o100644 << 16
                archive.writestr(info, members[member], zipfile.ZIP_DEFLATED, 9)
    except OSError as error:
        came = error.strerror or error
        raise InputError(f"{target}: expected a file that can be written, got {came}") from None
    return target


def read_archive(path: str | os.PathLike[str]) -> FmuFile:
    """Key data of an FMU from its description, without running it.

    Errors: `InputError` for a missing file, for one that is not a zip archive or is truncated or damaged, and for one
    without a readable modelDescription.xml.
    """
    source = Path(path)
    where = str(source)
    expect(source.exists(), "an FMU file", "no such file", where)
    expect(source.is_file(), "an FMU file", "a folder", where)
    try:
        with zipfile.ZipFile(source) as archive:
            _expect_size_limits(archive, where)
            damaged = archive.testzip()
            expect(damaged is None, "a whole zip archive", f"damaged content in {damaged}", where)
            members = tuple(archive.namelist())
            expect(DESCRIPTION in members, f"an FMU with {DESCRIPTION}", "a zip archive without it", where)
            root = parse_xml(_read(archive, DESCRIPTION, where), DESCRIPTION, where)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        size = source.stat().st_size
        raise InputError(
            f"{where}: expected an FMU (a whole zip archive), got {size} bytes that are none: {error}"
        ) from None
    except OSError as error:
        raise InputError(f"{where}: expected a readable file, got {error.strerror or error}") from None
    expect(root.tag == "fmiModelDescription", f"fmiModelDescription in {DESCRIPTION}", root.tag, where)
    simulation = root.find("CoSimulation")
    annotation = root.find(f"VendorAnnotations/Tool[@name='{TOOL}']/fmu")
    if annotation is None:
        annotation = root.find(f"Annotations/Annotation[@type='{TOOL}']/fmu")  # FMI 3.0
    return FmuFile(
        path=source,
        fmi_version=root.get("fmiVersion", ""),
        generation_tool=root.get("generationTool", ""),
        guid=root.get("guid") or root.get("instantiationToken", ""),
        model_identifier="" if simulation is None else simulation.get("modelIdentifier", ""),
        kind="" if annotation is None else annotation.get("kind", ""),
        backend="" if annotation is None else annotation.get("backend", ""),
        members=members,
    )


def read_members(file: FmuFile, names: Iterable[str]) -> dict[str, bytes]:
    """The content of some members. Errors: `InputError` for one that is missing or larger than `MAX_TEXT_BYTES`."""
    where = str(file.path)
    with zipfile.ZipFile(file.path) as archive:
        content: dict[str, bytes] = {}
        for name in names:
            expect(name in file.members, f"{name} in the FMU", "none", where)
            content[name] = _read(archive, name, where)
    return content


def _expect_size_limits(archive: zipfile.ZipFile, where: str) -> None:
    """Refuse an archive beyond the limits. Unpacking never exceeds the sizes that the archive's directory states."""
    infos = archive.infolist()
    expect(len(infos) <= MAX_MEMBERS, f"an FMU of at most {MAX_MEMBERS} members", len(infos), where)
    total = sum(info.file_size for info in infos)
    expect(total <= MAX_BYTES, f"an FMU of at most {MAX_BYTES} bytes unpacked", total, where)


def _read(archive: zipfile.ZipFile, name: str, where: str) -> bytes:
    size = archive.getinfo(name).file_size
    expect(size <= MAX_TEXT_BYTES, f"{name} of at most {MAX_TEXT_BYTES} bytes", size, where)
    return archive.read(name)


def parse_xml(content: bytes, name: str, where: str) -> ElementTree.Element:
    """The root element of a document. Errors: `InputError` for XML that is malformed, too deep or of unknown encoding.

    >>> parse_xml(b"<a><b/></a>", "a.xml", "here").tag
    'a'
    >>> parse_xml(b"<?xml version='1.0' encoding='klingon'?><a/>", "a.xml", "here")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: here: expected XML in a.xml, got unknown encoding: klingon
    """
    depth, root = 0, ElementTree.Element("")
    try:
        for event, element in ElementTree.iterparse(io.BytesIO(content), ("start", "end")):
            depth += 1 if event == "start" else -1
            expect(
                depth <= _MAX_DEPTH, f"XML in {name} of at most {_MAX_DEPTH} elements within each other", "more", where
            )
            root = element
        return root
    except InputError:
        raise
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"{where}: expected XML in {name}, got {' '.join(str(error).split())}") from None
