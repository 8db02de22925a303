# SPDX-License-Identifier: Apache-2.0
"""A Processing provider for QGIS."""


def classFactory(interface):  # what QGIS calls
    from .provider import Plugin
    return Plugin()
