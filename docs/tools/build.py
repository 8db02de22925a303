#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the manual's site with Doxygen and Sphinx; every warning is an error.

build.py ROOT BUILD TERRACE MODULE    writes BUILD/docs/html; MODULE is the folder with the Python package terrace.

Needs Debian's packages of doxygen, python3-sphinx, python3-myst-parser, python3-breathe and furo.
"""

import glob
import os
import re
import subprocess
import sys

import assemble
import command_pages
import theme


def run_doxygen(root, out):
    """Reads the public headers into out/xml."""
    with open(os.path.join(root, 'docs/Doxyfile'), encoding='utf-8') as file:
        settings = file.read()
    includes = ' '.join(f'"{path}"' for path in sorted(glob.glob(os.path.join(root, 'lib*/include'))))
    settings += f'INPUT = {includes}\nSTRIP_FROM_PATH = {includes}\nOUTPUT_DIRECTORY = "{out}"\n'
    os.makedirs(out, exist_ok=True)
    subprocess.run(['doxygen', '-'], input=settings, text=True, check=True)


def simplify(xml):
    """Removes from Doxygen's XML what readers of the interface do not need, and what Breathe cannot show."""
    for path in glob.glob(os.path.join(xml, '*.xml')):
        with open(path, encoding='utf-8') as file:
            text = before = file.read()
        # A namespace is in many headers, and would be described in each.
        if path.endswith('_8hpp.xml'):
            text = re.sub(r'\s*<innernamespace.*?</innernamespace>', '', text)
            text = re.sub(r'\s*<innerclass[^>]*>[^<]*&lt;.*?</innerclass>', '', text)  # specialisations
        text = re.sub(r'\s*<sectiondef kind="(?:private|friend|define)[^"]*">.*?</sectiondef>', '', text, flags=re.DOTALL)
        text = text.replace(' inline="yes"', ' inline="no"')
        members = re.split(r'(?=<memberdef )', text)
        text = ''.join(member for member in map(simple_member, members))
        if text != before:
            with open(path, 'w', encoding='utf-8') as file:
                file.write(text)


def simple_member(text):
    """One member of the XML, with what follows it; explicit instantiations are left out."""
    if not text.startswith('<memberdef '):
        return text
    if re.search(r'<definition>(?:extern )?template ', text):
        return text[text.index('</memberdef>') + len('</memberdef>'):]
    # Doxygen takes the name `local` for a keyword, and a digit separator for the beginning of a character.
    text = re.sub(r'<type></type>(\s*<definition>[^<]*::)bool<(.*?)<name>bool</name>', r'<type>bool</type>\1local<\2<name>local</name>',
                  text, flags=re.DOTALL)
    text = re.sub(r"(\d) ?(?:'|&apos;)(\d{3})", r'\1\2', text)
    # Breathe leaves out a requires-clause. It goes in front of the type of a template, otherwise into the description.
    clause = re.search(r'\s*<requiresclause>(.*?)\s*</requiresclause>', text, re.DOTALL)
    if clause:
        text = text.replace(clause.group(0), '')
        head, end, body = text.rpartition('</templateparamlist>')
        if head:
            body = re.sub(r'<type\s*/>|<type>', lambda tag: f'<type>requires {clause.group(1)} ' + ('</type>' if '/' in tag.group(0) else ''),
                          body, count=1)
            text = head + end + body
        else:
            text = text.replace('<briefdescription>', f'<briefdescription><para>Requires {clause.group(1)}.</para>', 1)
    return text


def main():
    root, build, terrace, module = map(os.path.abspath, sys.argv[1:5])
    out = os.path.join(build, 'docs')
    source, doxygen, html = (os.path.join(out, name) for name in ('source', 'doxygen', 'html'))
    broken = assemble.assemble(root, source)
    for line in broken:
        print(line, file=sys.stderr)
    if broken:
        return 1
    command_pages.write_markdown(root, terrace, os.path.join(source, 'reference', 'commands'))
    run_doxygen(root, doxygen)
    simplify(os.path.join(doxygen, 'xml'))
    environment = dict(os.environ, TERRACE_DOXYGEN=os.path.join(doxygen, 'xml'), PYTHONDONTWRITEBYTECODE='1',
                       PYTHONPATH=module)
    # Pages of an earlier run are not reused: their sources are new files.
    status = subprocess.run([sys.executable, '-m', 'sphinx', '-b', 'html', '-q', '-W', '--keep-going', '-E', '-j', 'auto',
                             '-d', os.path.join(out, 'doctrees'), '-c', os.path.join(root, 'docs'), source, html],
                            env=environment, check=False).returncode
    if status == 0:
        theme.mend(os.path.join(html, '_static'))
    return status


if __name__ == '__main__':
    sys.exit(main())
