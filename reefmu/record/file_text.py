"""The text of a measured file: compression and character encoding, and a remedy for files that hold no text."""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from pathlib import Path

from stiffness_model.errors import InputError

_NOT_TEXT = {
    b"PK\x03\x04": ("an Excel workbook or a zip archive", "save the sheet as CSV, or unpack the archive"),
    b"\xd0\xcf\x11\xe0": ("an old Excel workbook", "save the sheet as CSV"),
    b"\x89HDF": ("an HDF5 file", "export the signals as CSV"),
    b"MATLAB 5.0": ("a MATLAB file", "export the signals with writetable"),
    b"PAR1": ("a Parquet file", "export the table as CSV"),
    b"TDSm": ("a LabVIEW TDMS file", "export the channels as CSV"),
    b"BZh": ("a bzip2 archive", "unpack it, or compress it with gzip"),
    b"\xfd7zXZ": ("an xz archive", "unpack it, or compress it with gzip"),
}
"""First bytes of files that are met in place of a CSV file: what they are, and the remedy."""
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8 with a byte order mark"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
UTF16_SAMPLE = 512
"""Bytes in which zeros at every other place show UTF-16 without a byte order mark. Chosen by judgement: the header of a
record lies within them and consists of Latin letters."""


def read_text_file(path: Path, where: str) -> tuple[str, str]:
    """The text of a plain or gzip-compressed file, and the name of its encoding.

    UTF-8 and UTF-16 are recognised; other text counts as Latin-1, in which every byte is a character. Raises
    `InputError` for a file that cannot be read or holds no text.
    """
    try:
        raw = path.read_bytes()
        raw = gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{where}: expected a readable CSV file, got {reason}") from None
    for start, (kind, remedy) in _NOT_TEXT.items():
        if raw.startswith(start):
            raise InputError(f"{where}: expected a readable CSV file, got {kind}; {remedy}")
    text, encoding = _decode(raw, where)
    if found := _CONTROL.search(text):
        raise InputError(
            f"{where}: expected a readable CSV file, got binary data (byte {ord(found[0])} at character "
            f"{found.start() + 1}); export the record as CSV"
        )
    return text, encoding


def _decode(raw: bytes, where: str) -> tuple[str, str]:
    try:
        for mark, codec, name in _BYTE_ORDER_MARKS:
            if raw.startswith(mark):
                return raw.decode(codec), name
        # Latin letters in UTF-16 have a zero byte each, the second one where the low byte comes first.
        start = raw[:UTF16_SAMPLE]
        for zeros, codec in ((start[1::2], "utf-16-le"), (start[::2], "utf-16-be")):
            if len(raw) % 2 == 0 and zeros and zeros.count(0) > 0.8 * len(zeros):
                return raw.decode(codec), "UTF-16"
    except UnicodeDecodeError as error:
        raise InputError(f"{where}: expected a readable CSV file, got {error}") from None
    try:
        return raw.decode("utf-8"), "UTF-8"
    except UnicodeDecodeError:
        return raw.decode("latin-1"), "Latin-1"
