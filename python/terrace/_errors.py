# SPDX-License-Identifier: Apache-2.0
"""The exception for bad data."""


class Error(Exception):
    """Bad data: file, place, cause and remedy in one line."""

    __module__ = 'terrace'
