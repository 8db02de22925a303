#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the commands of README.md as printed, in a folder with the contents of a clone.

TERRACE=path/to/terrace readme_test.py
"""

import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TERRACE = os.path.abspath(os.environ['TERRACE'])


def readme():
    with open(os.path.join(ROOT, 'README.md'), encoding='utf-8') as file:
        return file.read()


class ReadmeTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix='terrace-readme-')
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_commands_run_in_a_clone(self):
        block = re.search(r'## Use\n.*?```sh\n(.*?)```', readme(), re.DOTALL).group(1)
        lines = block.splitlines()
        self.assertGreater(len(lines), 10)
        # The contents of a clone, and the output of ./dev in it.
        os.makedirs(os.path.join(self.folder, 'libterrain'))
        shutil.copytree(os.path.join(ROOT, 'libterrain/examples'), os.path.join(self.folder, 'libterrain/examples'))
        os.makedirs(os.path.join(self.folder, 'build/tools/src'))
        os.symlink(TERRACE, os.path.join(self.folder, 'build/tools/src/terrace'))
        last = lines.pop()
        self.assertTrue(last.startswith('terrace view '), last)
        result = subprocess.run(['bash', '-eu', '-c', '\n'.join(lines)], cwd=self.folder, capture_output=True, text=True,
                                timeout=500, check=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in re.findall(r' -o (\S+)', block):
            self.assertTrue(os.path.exists(os.path.join(self.folder, name)), name)
        self.view(lines[0], last.partition('#')[0])

    def view(self, path, command):
        """Runs the viewer, which serves until it is interrupted."""
        viewer = subprocess.Popen(['bash', '-eu', '-c', f'{path}\nexec {command} --no-open --port 0'], cwd=self.folder,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            for line in viewer.stdout:
                if 'http://' in line:
                    break
            else:
                self.fail('the viewer ended without printing an address')
            viewer.send_signal(signal.SIGINT)
            viewer.stdout.read()
            viewer.wait(timeout=60)
        finally:
            viewer.kill()
            viewer.wait()
            viewer.stdout.close()

    def test_links_in_the_readme_exist(self):
        links = re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', readme())
        for wanted in ('tools/README.md', 'viewer/README.md', 'python/README.md'):
            self.assertIn(wanted, links)
        for link in links:
            self.assertTrue(os.path.exists(os.path.join(ROOT, link)), link)


if __name__ == '__main__':
    unittest.main()
