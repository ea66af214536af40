"""Scripts that complete calls of the program, for bash, zsh and fish."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator

from .words import Completed, CompletedCommand, Files, completed_commands

SHELLS = ("bash", "zsh", "fish")
_BASH = """\
# Completion of `reefmu` in bash. For this shell: eval "$(reefmu completion bash)"; for all that start later:
#   reefmu completion bash > ~/.local/share/bash-completion/completions/reefmu
_reefmu() {{
    # Readline splits words at =, too.
    [[ ${{COMP_WORDS[COMP_CWORD]}} == = || ${{COMP_WORDS[COMP_CWORD-1]}} == = ]] && return 0
    local IFS=$'\\n' cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} command="" words="" files="" i
    for ((i = 1; i < COMP_CWORD; i++)); do
        case ${{COMP_WORDS[i]}} in
            {names}) command=${{COMP_WORDS[i]}}; break ;;
        esac
    done
    case "$command $prev" in
{values}
        *)
            case $command in
{commands}
            esac ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$cur"))
    case $files in
        files) COMPREPLY+=($(compgen -f -- "$cur")); compopt -o filenames 2>/dev/null ;;
        folders) COMPREPLY+=($(compgen -d -- "$cur")); compopt -o filenames 2>/dev/null ;;
    esac
    # What ends with = needs its value, without a space.
    [[ ${{#COMPREPLY[@]}} -gt 0 && ${{COMPREPLY[0]}} == *= ]] && compopt -o nospace 2>/dev/null
    return 0
}}
complete -F _reefmu reefmu
"""
_ZSH = """\
# Completion of `reefmu` in zsh, by the functions for bash that zsh provides. In ~/.zshrc:
#   eval "$(reefmu completion zsh)"
autoload -U +X compinit && compinit
autoload -U +X bashcompinit && bashcompinit
"""
_ZSH_END = """\
_reefmu_zsh() {
    _reefmu
    # zsh knows no compopt: a space follows every word but those that end with =, which need a value.
    COMPREPLY=("${COMPREPLY[@]/%/ }")
    COMPREPLY=("${COMPREPLY[@]/%= /=}")
}
complete -o nospace -F _reefmu_zsh reefmu
"""
_FISH = """\
# Completion of `reefmu` in fish: reefmu completion fish > ~/.config/fish/completions/reefmu.fish
complete -c reefmu -f
"""


def completion_script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script for one of `SHELLS`. parser: that of the program."""
    commands = completed_commands(parser)
    if shell == "fish":
        return _FISH + "\n".join(_fish(commands)) + "\n"
    return _bash(commands) if shell == "bash" else _ZSH + _bash(commands) + _ZSH_END


def _bash(commands: list[CompletedCommand]) -> str:
    program, *others = commands
    values = [line for command in commands for line in _bash_values(command)]
    lines = [_bash_command(program, [command.name for command in others])]
    lines += [_bash_command(command, []) for command in others]
    names = "|".join(command.name for command in others)
    return _BASH.format(names=names, values="\n".join(values), commands="\n".join(lines))


def _bash_values(command: CompletedCommand) -> Iterator[str]:
    """The branch for the value of each option."""
    for option in command.options:
        if option.takes_value:
            cases = "|".join(f'"{command.name} {flag}"' for flag in option.flags)
            yield f"        {cases}) {_bash_result(option.words, option.files)} ;;"


def _bash_command(command: CompletedCommand, names: list[str]) -> str:
    """The branch of a command: its options where a word begins with -, otherwise what its arguments take."""
    flags = [flag for option in command.options for flag in option.flags]
    words = [*names, *(word for argument in command.arguments for word in argument.words)]
    files = next((a.files for a in command.arguments if a.files is not Files.NONE), Files.NONE)
    name = command.name or '""'
    return (
        f"                {name}) if [[ $cur == -* ]]; then {_bash_result(tuple(flags), Files.NONE)}; "
        f"else {_bash_result(tuple(words), files)}; fi ;;"
    )


def _bash_result(words: tuple[str, ...], files: Files) -> str:
    # One word a line, as IFS splits them, in the quotes of bash that read \\n; spaces within a word stay.
    quoted = "\\n".join(word.replace("\\", "\\\\").replace("'", "\\'") for word in words)
    return f"words=$'{quoted}' files={'' if files is Files.NONE else files.value}"


def _fish(commands: list[CompletedCommand]) -> Iterator[str]:
    program, *others = commands
    for command in others:
        yield f"complete -c reefmu -n __fish_use_subcommand -a {command.name} -d {_fish_text(command.help)}"
    for option in program.options:
        yield f"complete -c reefmu -n __fish_use_subcommand {_fish_option(option)}"
    for command in others:
        condition = f"-n '__fish_seen_subcommand_from {command.name}'"
        for option in command.options:
            yield f"complete -c reefmu {condition} {_fish_option(option)}"
        for argument in command.arguments:
            yield f"complete -c reefmu {condition} {_fish_values(argument)} -d {_fish_text(argument.help)}"


def _fish_option(option: Completed) -> str:
    flags = [f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}" for flag in option.flags]
    values = [f"-r {_fish_values(option)}"] if option.takes_value else []
    return " ".join([*flags, *values, "-d", _fish_text(option.help)])


def _fish_values(completed: Completed) -> str:
    folders = "(__fish_complete_directories)" if completed.files is Files.FOLDERS else ""
    words = " ".join([*(shlex.quote(word) for word in completed.words), *([folders] if folders else [])])
    parts = ["-F"] if completed.files is Files.FILES else ["-f"]
    return " ".join([*parts, *([f"-a {_fish_text(words)}"] if words else [])])


def _fish_text(text: str) -> str:
    """A text in single quotes, in which fish reads a backslash before quotes and backslashes alone."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
