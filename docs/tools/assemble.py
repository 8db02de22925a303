#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Collects the sources of the manual in one folder, from which Sphinx builds the site.

assemble.py ROOT OUT    fails with one line per link that leads nowhere.

The pages of docs/ keep their places. READMEs and other texts of the repository become pages, and links between all
of them are rewritten. A link to any other file of the repository becomes a link to a copy of it.
"""

import os
import re
import shutil
import sys

LIBRARIES = ['base', 'stream', 'cluster', 'matching', 'tri', 'terrain']
# What stays where it is and is a page of the manual too. Where docs/ has that page itself, links lead there.
PAGES = {
    'README.md': 'index.md',
    'ARCHITECTURE.md': 'project/architecture.md',
    'CONTRIBUTING.md': 'project/contributing.md',
    'CHANGELOG.md': 'project/changes.md',
    'libstream/FORMAT.md': 'reference/store-format.md',
    'research/README.md': 'background/research.md',
    'tools/README.md': 'reference/command-details.md',
    'viewer/README.md': 'reference/viewer.md',
    'python/README.md': 'reference/python-overview.md',
} | {f'lib{library}/README.md': f'reference/cpp/{library}/index.md' for library in LIBRARIES}
# Pages that command_pages.py makes.
GENERATED = {'docs/reference/commands/index.md': 'reference/commands/index.md'}
# Folders and files of docs/ that are not pages.
NOT_PAGES = ('tools', 'commands', 'conf.py', 'Doxyfile', 'meson.build')

LINK = re.compile(r'(`+)(?:(?!\1).)+?\1|\[((?:[^\[\]`]|`[^`]*`|\[[^\]]*\]\([^)]*\))*)\]\(([^)\s]+)\)', re.DOTALL)


def docs_pages(root):
    """Paths of the files of docs/ that belong to the manual, relative to docs/."""
    docs = os.path.join(root, 'docs')
    for folder, folders, names in os.walk(docs):
        here = os.path.relpath(folder, docs)
        folders[:] = sorted(name for name in folders if name != '__pycache__' and not (here == '.' and name in NOT_PAGES))
        for name in sorted(names):
            if not (here == '.' and name in NOT_PAGES):
                yield os.path.normpath(os.path.join(here, name))


def pages(root):
    """Maps each source, relative to the root, to its place in the manual. A page of docs/ comes last."""
    found = {source: page for source, page in PAGES.items() if os.path.isfile(os.path.join(root, source))}
    found.update({f'docs/{path}': path for path in docs_pages(root)})
    return found


class Links:
    """Rewrites the links of pages, and collects the files to copy and the links that lead nowhere."""

    def __init__(self, root, targets):
        self.root, self.targets = root, targets
        self.copies, self.broken = {}, []

    def rewrite(self, source, page, text):
        def one_link(match):
            label, link = match.group(2), match.group(3)
            if label is None or re.match(r'[a-z]+:|#', link):
                return match.group(0)
            if '](' in label:  # a picture in a link
                label = LINK.sub(one_link, label)
            path, mark, anchor = link.partition('#')
            path = os.path.normpath(os.path.join(os.path.dirname(source), path))
            full = os.path.join(self.root, path)
            if os.path.isdir(full):
                if f'{path}/README.md' not in self.targets:
                    return label
                path, full = f'{path}/README.md', f'{full}/README.md'
            if path not in GENERATED and (path.startswith('..') or not os.path.isfile(full)):
                number = text.count('\n', 0, start + match.start()) + 1
                self.broken.append(f'{source}:{number}: the link to {link} leads nowhere')
                return match.group(0)
            target = self.targets.get(path) or GENERATED.get(path)
            if target is None:
                target = self.copies.setdefault(path, f'files/{path}')
            return f'[{label}]({os.path.relpath(target, os.path.dirname(page))}{mark}{anchor})'

        parts = re.split(r'(^```.*?^```$)', text, flags=re.DOTALL | re.MULTILINE)
        done, start = [], 0
        for index, part in enumerate(parts):
            done.append(part if index % 2 else LINK.sub(one_link, part))
            start += len(part)
        return ''.join(done)


def header_pages(root, out, library):
    """Writes a page for each public header of a library and returns their names."""
    folder = f'lib{library}/include/terrace/{library}'
    names = sorted(name[:-4] for name in os.listdir(os.path.join(root, folder)) if name.endswith('.hpp'))
    for name in names:
        with open(os.path.join(out, 'reference/cpp', library, f'{name}.md'), 'w', encoding='utf-8') as file:
            file.write(f'# {name}.hpp\n\n`#include <terrace/{library}/{name}.hpp>`\n\n'
                       f'```{{doxygenfile}} terrace/{library}/{name}.hpp\n```\n')
    return names


TOCTREE = re.compile(r'^```\{toctree\}\n(.*?)^```$', re.DOTALL | re.MULTILINE)


def listed(page, text):
    """The pages that the tables of contents of a page name, without their endings."""
    for block in TOCTREE.findall(text):
        for line in block.split('\n'):
            entry = re.sub(r'.*<(.*)>', r'\1', line.strip())
            if entry and not entry.startswith(':'):
                yield os.path.normpath(os.path.join('/', os.path.dirname(page), entry))[1:]


def add_contents(out):
    """Adds a table of contents to each index.md: the pages of its folder that none has, in the order of its links."""
    names = [os.path.relpath(os.path.join(folder, name), out) for folder, _, files in os.walk(out) for name in files
             if name.endswith('.md') and not os.path.relpath(folder, out).startswith('files')]
    texts = {}
    for name in names:
        with open(os.path.join(out, name), encoding='utf-8') as file:
            texts[name] = file.read()
    known = {entry for name, text in texts.items() for entry in listed(name, text)}
    free = {name[:-3] for name in names} - known - {'index'}
    for name in sorted(names):
        folder = os.path.dirname(name)
        if os.path.basename(name) != 'index.md':
            continue
        own = [page for page in free if page != name[:-3] and folder in (
            os.path.dirname(page), os.path.dirname(os.path.dirname(page)) if page.endswith('/index') else None)]
        if not own:
            continue
        order = {os.path.normpath(os.path.join(folder, link)): place for place, link in
                 reversed(list(enumerate(re.findall(r'\]\(([^)\s#]+)\.md', texts[name]))))}
        own.sort(key=lambda page: (order.get(page, len(order) + 1), page))
        entries = '\n'.join(f'/{page}' for page in own)
        contents = f'```{{toctree}}\n:hidden:\n:maxdepth: 2\n\n{entries}\n```\n'
        first = TOCTREE.search(texts[name])
        at = first.start() if first else len(texts[name])
        with open(os.path.join(out, name), 'w', encoding='utf-8') as file:
            file.write(texts[name][:at] + ('' if first else '\n') + contents + ('\n' if first else '') + texts[name][at:])


def assemble(root, out):
    """Fills the folder and returns the links that lead nowhere."""
    targets = pages(root)
    links = Links(root, targets)
    shutil.rmtree(out, ignore_errors=True)
    for source, page in targets.items():
        if source in PAGES and os.path.isfile(os.path.join(root, 'docs', page)):
            continue
        goal = os.path.join(out, page)
        os.makedirs(os.path.dirname(goal), exist_ok=True)
        if not source.endswith('.md'):
            shutil.copyfile(os.path.join(root, source), goal)
            continue
        with open(os.path.join(root, source), encoding='utf-8') as file:
            text = links.rewrite(source, page, file.read())
        with open(goal, 'w', encoding='utf-8') as file:
            file.write(text)
    for path, copy in links.copies.items():
        os.makedirs(os.path.dirname(os.path.join(out, copy)), exist_ok=True)
        shutil.copyfile(os.path.join(root, path), os.path.join(out, copy))
    for library in LIBRARIES:
        names = header_pages(root, out, library)
        with open(os.path.join(out, PAGES[f'lib{library}/README.md']), 'a', encoding='utf-8') as file:
            entries = [f'{name}.hpp <{name}>' for name in names]
            if os.path.isfile(os.path.join(out, f'reference/libraries/{library}.md')):
                entries.insert(0, f'In detail </reference/libraries/{library}>')
            lines = '\n'.join(entries)
            file.write(f'\n## Pages of this library\n\n```{{toctree}}\n:maxdepth: 1\n\n{lines}\n```\n')
    add_contents(out)
    return links.broken


def main():
    broken = assemble(sys.argv[1], sys.argv[2])
    for line in broken:
        print(line, file=sys.stderr)
    return 1 if broken else 0


if __name__ == '__main__':
    sys.exit(main())
