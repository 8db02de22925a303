#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes completion of the command's verbs and options for bash, zsh and fish from its --help.

completion.py TERRACE BASH ZSH FISH    the names of the three files
"""

import re
import sys

from command_help import Command, Verb

HEAD = '# Completion of the command terrace, made from its --help by docs/tools/completion.py.\n'


def first_clause(text):
    """The part of a description that fits next to an option in a list."""
    short = re.sub(r' ?\([^()]*\)', '', text).split(';')[0].split(': ')[0]
    return short if len(short) <= 72 else short[:71].rsplit(' ', 1)[0] + ' ...'


def bash_file(command, verbs):
    names = ' '.join(name for name, _ in command.verbs)
    text = HEAD + f'''_terrace() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} words=
  COMPREPLY=()
  if [ "$COMP_CWORD" = 1 ]; then
    words='{names} help --help --version'
  elif [ "$COMP_CWORD" = 2 ] && [ "${{COMP_WORDS[1]}}" = help ]; then
    words='{names}'
  else
    case "${{COMP_WORDS[1]}} ${{COMP_WORDS[COMP_CWORD - 1]}}" in
'''
    for verb in verbs:
        for option in verb.options:
            if option.choices:
                for name in option.names:
                    text += f"      '{verb.name} {name}') words='{' '.join(option.choices)}' ;;\n"
    text += '    esac\n    if [ -z "$words" ] && [[ $current == -* ]]; then\n      case ${COMP_WORDS[1]} in\n'
    for verb in verbs:
        options = ' '.join(name for option in verb.options if not option.operand for name in option.names)
        text += f"        {verb.name}) words='{options}' ;;\n"
    return text + '''      esac
    fi
  fi
  local IFS=$' \\t\\n'
  # Without words the shell completes the names of files.
  # shellcheck disable=SC2207  # the words have no spaces
  [ -z "$words" ] || COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _terrace terrace
'''


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh_text(text):
    """A description between brackets of _arguments."""
    for special in '\\[]:':
        text = text.replace(special, '\\' + special)
    return text


def zsh_file(command, verbs):
    text = '#compdef terrace\n' + HEAD + '_terrace() {\n  local -a verbs\n  verbs=(\n'
    for name, brief in command.verbs:
        text += f'    {quoted(f"{name}:{brief}")}\n'
    text += '''  )
  if (( CURRENT == 2 )); then
    _describe verb verbs
    return
  fi
  local verb=$words[2]
  shift words
  (( CURRENT-- ))
  case $verb in
'''
    for verb in verbs:
        text += f'    {verb.name})\n      _arguments \\\n'
        for option in verb.options:
            if option.operand:
                continue
            described = f'[{zsh_text(first_clause(option.text))}]'
            if option.choices:
                described += f':{option.value}:({" ".join(option.choices)})'
            elif option.value:
                described += f':{option.value}:' + ('_files' if option.takes_file else '')
            for name in option.names:
                others = '*' if option.many else f'({" ".join(option.names)})'
                text += f'        {quoted(others + name + described)} \\\n'
        text += "        '*:file:_files'\n      ;;\n"
    return text + '  esac\n}\n_terrace "$@"\n'


def fish_file(command, verbs):
    text = HEAD
    for name, brief in command.verbs:
        text += f'complete -c terrace -f -n __fish_use_subcommand -a {name} -d {quoted(brief)}\n'
    text += 'complete -c terrace -f -n __fish_use_subcommand -l version -d "show version, build and parts"\n'
    for verb in verbs:
        for option in verb.options:
            if option.operand:
                continue
            names = ' '.join(f'-l {name[2:]}' if name.startswith('--') else f'-s {name[1:]}' for name in option.names)
            value = ''
            if option.choices:
                value = f' -x -a {quoted(" ".join(option.choices))}'
            elif option.value:
                value = ' -r -F' if option.takes_file else ' -x'
            text += (f'complete -c terrace -n {quoted("__fish_seen_subcommand_from " + verb.name)} {names}{value}'
                     f' -d {quoted(first_clause(option.text))}\n')
    return text


def main():
    terrace, *paths = sys.argv[1:]
    command = Command(terrace)
    verbs = [Verb(terrace, name) for name, _ in command.verbs]
    for path, make in zip(paths, (bash_file, zsh_file, fish_file)):
        with open(path, 'w', encoding='utf-8') as file:
            file.write(make(command, verbs))


if __name__ == '__main__':
    main()
