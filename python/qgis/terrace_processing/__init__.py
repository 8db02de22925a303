# SPDX-License-Identifier: Apache-2.0
"""A Processing provider for QGIS."""


def classFactory(interface):  # called by QGIS
    from .provider import Plugin
    return Plugin()
