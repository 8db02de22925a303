# SPDX-License-Identifier: Apache-2.0
"""Docstrings exist, and their examples are correct."""

import doctest
import importlib
import pkgutil
import unittest

import terrace


class Docstrings(unittest.TestCase):
    def test_examples_are_correct(self):
        attempted = 0
        for name in ['terrace'] + [f'terrace.{module.name}' for module in pkgutil.iter_modules(terrace.__path__)]:
            result = doctest.testmod(importlib.import_module(name))
            self.assertEqual(result.failed, 0, name)
            attempted += result.attempted
        self.assertGreater(attempted, 25)

    def test_everything_public_has_a_docstring(self):
        for name in terrace.__all__:
            item = getattr(terrace, name)
            self.assertTrue(item.__doc__, name)
            if isinstance(item, type):
                for member, value in vars(item).items():
                    if not member.startswith('_') and (callable(value) or isinstance(value, (property, classmethod))):
                        self.assertTrue(getattr(item, member).__doc__ if callable(getattr(item, member)) else value.__doc__,
                                        f'{name}.{member}')


if __name__ == '__main__':
    unittest.main()
