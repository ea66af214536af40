"""`reefmu completion`: scripts that know every command and option, and bash as it completes with its own."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from reefmu.cli import build_parser, main
from reefmu.cli.argument_types import actions_of
from reefmu.cli.completion.scripts import SHELLS, completion_script
from reefmu.cli.completion.words import completed_commands
from reefmu.cli.parser import FIRST_STEPS
from reefmu.effects import EFFECTS
from stiffness_model.kinds import KINDS

SCRIPTS = {shell: completion_script(build_parser(), shell) for shell in SHELLS}


def completed(folder: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words."""
    line = " ".join(shlex.quote(word) for word in ("reefmu", *words))
    code = f"COMP_WORDS=({line}); COMP_CWORD={len(words)}; _reefmu; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    done = subprocess.run(
        ["bash", "--norc", "-c", SCRIPTS["bash"] + code], cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.split("\n")[:-1]


CASES = [
    (["cur"], ["curve"]),
    (["-q", "mat"], ["materials"]),
    (["--vers"], ["--version"]),
    (["curve", "work"], ["workshop"]),
    (["curve", "CHA-40A-"], ["CHA-40A-50"]),
    (["curve", "my"], ["my drive.toml"]),
    (["curve", "drive_1", "--dri"], ["--drives"]),
    (["curve", "drive_1", "--drives", ""], [""]),
    (["curve", "drive_1", "--set", "crank_ra"], ["crank_radius="]),
    (["curve", "drive_1", "--format", ""], ["png", "svg", "pdf"]),
    (["curve", "drive_1", "--out", "o"], ["old"]),
    (["export", "drive_1", "--effect", "backlash"], ["backlash.clearance="]),
    (["export", "drive_1", "--platform", "w"], ["win64"]),
    (["effects", "load"], ["load_dependent_hysteresis"]),
    (["new", "--kind", "c"], ["cycloidal", "catalogue"]),
    (["explore", "tol"], ["tolerance_field"]),
    (["completion", "z"], ["zsh"]),
]
"""Words of a call, and what completes the last of them."""
AT_EQUALS = ["curve", "drive_1", "--set", "lobes", "=", ""]
"""Readline splits words at =; the value of a field has no words."""


def fish_words(folder: Path, *words: str) -> list[str]:
    """What fish offers for the last of the words."""
    (folder / "reefmu.fish").write_text(SCRIPTS["fish"], encoding="utf-8")
    line = " ".join([*(shlex.quote(word) for word in ("reefmu", *words[:-1])), words[-1]])
    code = f"source reefmu.fish; complete -C {shlex.quote(line)}"
    done = subprocess.run(["fish", "--no-config", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return [offered.split("\t")[0].rstrip("/") for offered in done.stdout.splitlines()]


def zsh_words(folder: Path, *words: str) -> list[str]:
    """What the script offers zsh for the last of the words, with the spaces that follow.

    Outside of its completion zsh's `compgen` gives all words; those that do not begin as the last one are left out.
    """
    line = " ".join(shlex.quote(word) for word in ("reefmu", *words))
    # As zsh's own functions for bash call it.
    call = "f() { emulate -L sh; setopt kshglob noshglob braceexpand nokshautoload; _reefmu_zsh; }; f"
    code = f'COMP_WORDS=({line}); COMP_CWORD={len(words)}; {call}; print -l -- "${{COMPREPLY[@]}}"'
    script = SCRIPTS["zsh"].replace("compinit && compinit", "compinit && compinit -D")
    done = subprocess.run(["zsh", "-f", "-c", script + code], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return [offered for offered in done.stdout.split("\n")[:-1] if offered.startswith(words[-1])]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "my drive.toml").touch()
    (tmp_path / "old").mkdir()
    (tmp_path / "odd.txt").touch()
    return tmp_path


def named(case: object) -> str:
    return " ".join(map(str, case)) if isinstance(case, list) else ""


@pytest.mark.skipif(not shutil.which("bash"), reason="not part of this repository: bash")
@pytest.mark.parametrize(("words", "expected"), [*CASES, (AT_EQUALS, [""])], ids=named)
def test_bash_completes(words: list[str], expected: list[str], folder: Path) -> None:
    assert completed(folder, *words) == expected


@pytest.mark.skipif(not shutil.which("fish"), reason="not part of this repository: fish")
@pytest.mark.parametrize(("words", "expected"), CASES, ids=named)
def test_fish_completes(words: list[str], expected: list[str], folder: Path) -> None:
    assert sorted(fish_words(folder, *words)) == sorted(filter(None, expected))


@pytest.mark.skipif(not shutil.which("zsh"), reason="not part of this repository: zsh")
@pytest.mark.parametrize(("words", "expected"), CASES, ids=named)
def test_zsh_completes(words: list[str], expected: list[str], folder: Path) -> None:
    """With a space after every word but one that needs a value."""
    spaced = [word if word.endswith("=") else f"{word} " for word in expected]
    assert sorted(filter(None, zsh_words(folder, *words))) == sorted(filter(str.strip, spaced))


@pytest.mark.parametrize("shell", SHELLS)
def test_every_command_and_option_is_in_the_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert script == SCRIPTS[shell]
    for command in completed_commands(build_parser())[1:]:
        assert re.search(rf"(?<![\w-]){command.name}(?![\w-])", script)
        for flag in (flag for option in command.options for flag in option.flags if flag.startswith("--")):
            assert (f"-l {flag[2:]} " if shell == "fish" else flag) in script, flag


def test_lines_for_fish_are_words_in_balanced_quotes() -> None:
    lines = [line for line in SCRIPTS["fish"].splitlines() if not line.startswith("#")]
    # A quote within single quotes is \' in fish, '\'' in the shells that shlex reads.
    words = [shlex.split(line.replace("\\'", "'\\''")) for line in lines]
    assert all(line[:3] == ["complete", "-c", "reefmu"] for line in words)
    assert sum(" -d " in line for line in lines) == len(lines) - 1


def test_the_words_are_those_that_are_declared() -> None:
    commands = {command.name: command for command in completed_commands(build_parser())}
    assert set(commands["effects"].arguments[0].words) == set(EFFECTS)
    kinds = next(option for option in commands["new"].options if "--kind" in option.flags)
    assert [word.replace("-", " ") for word in kinds.words] == list(KINDS)


def test_a_call_without_a_command_says_what_to_do_first(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    shown = capsys.readouterr()
    assert shown.out == FIRST_STEPS + "\n"
    assert shown.err == ""
    calls = re.findall(r"reefmu (\S.*?)  ", FIRST_STEPS)
    assert {"demo", "new", "curve", "export", "gears", "record"} <= {call.split()[0] for call in calls}
    for call in calls:
        build_parser().parse_args(shlex.split(call))


def test_every_option_is_explained() -> None:
    parser = build_parser()
    for command in completed_commands(parser):
        assert all(found.help for found in (*command.options, *command.arguments)), command.name
    assert len(actions_of(parser)) > 3
