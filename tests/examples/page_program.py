"""Runs the code of a page of the documentation: `python page_program.py PAGE.md`.

Blocks marked `python` run in one session, calls of `reefmu` in blocks marked `sh` run between them, in the order of the
page and in the current folder. A comment `<!-- not run: REASON -->` above a block excludes it, as do the comments that
mark the README's two commands, which CI runs itself.
"""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path
from typing import NamedTuple

EXCLUDED = re.compile(r"<!-- (?:not run: .+|main command|test command) -->\s*$")


class Block(NamedTuple):
    """A block of code: what follows the fence, the text, and the line of the page on which the text begins."""

    language: str
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    """The blocks of a page that run, in their order."""
    text = page.read_text("utf-8")
    found: list[Block] = []
    for fence in re.finditer(r"^```(python|sh)\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if not EXCLUDED.search(text[: fence.start()]):
            found.append(Block(fence[1], fence[2], text.count("\n", 0, fence.start(2))))
    return found


def calls(block: Block) -> list[list[str]]:
    """The words of each call of a shell block. Raises `AssertionError` for another program than reefmu."""
    lines = [line for line in block.text.replace("\\\n", " ").splitlines() if line.strip()]
    found = [words for words in (shlex.split(line, comments=True) for line in lines) if words]
    others = [words for words in found if words[0] != "reefmu"]
    assert not others, f"expected calls of reefmu in a block marked sh, got {others}"
    return found


def main(page: Path) -> None:
    """Run the blocks of a page."""
    from reefmu.cli import main as reefmu

    session: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        if block.language == "python":
            exec(compile("\n" * block.line + block.text, str(page), "exec"), session)
        else:
            for words in calls(block):
                print("$", *words, flush=True)
                status = reefmu(words[1:])
                assert status == 0, f"{page.name}: {shlex.join(words)}: exit status {status}"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
