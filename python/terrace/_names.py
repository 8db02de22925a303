# SPDX-License-Identifier: Apache-2.0
"""The names that options accept. The compiled half has the same ones, next to the libraries' enumerators."""

from typing import Literal

Interpolation = Literal['linear', 'natural', 'nearest']
GradientMethod = Literal['linear', 'natural']
Quality = Literal['greedy', 'removal', 'fitted']
Duplicates = Literal['all', 'min', 'max', 'mean', 'first', 'error']
Fill = Literal['none', 'flat', 'interpolate']
Smoothing = Literal['laplacian', 'taubin', 'bilateral']
SurfaceSmoothing = Literal['taubin', 'bilateral']
RasterValue = Literal['height', 'slope', 'aspect', 'hillshade']
Vertical = Literal['recorded', 'ellipsoidal', 'orthometric', 'ignore']
Effort = Literal['fast', 'default', 'fine', 'full']
ClusterMethod = Literal['fast', 'automatic', 'full-scan', 'quadtree', 'octree', 'kd-tree', 'facilities', 'interchange', 'jain-vazirani',
                        'greedy-stars']
#: Those of ClusterMethod that work on a matrix of costs.
MatrixMethod = Literal['interchange', 'jain-vazirani', 'greedy-stars']
LinkageMethod = Literal['single', 'complete', 'average', 'weighted', 'ward', 'centroid', 'median']
HalvingMethod = Literal['monotone', 'monte-carlo']
Order = Literal['auto', 'stream', 'spatial']
Entities = Literal['points', 'triangles', 'segments', 'polylines']
HeightsOfColour = Literal['none', 'mapbox', 'terrarium']
ShapeRule = Literal['poles', 'flood', 'published']
ShapeCriterion = Literal['gabriel', 'edge-length']
SurfaceOrigin = Literal['auto', 'input', 'restored']
ViewKind = Literal['mesh', 'points', 'surface']
ViewReader = Literal['thread', 'frame']
ModelKind = Literal['mesh', 'volume']
