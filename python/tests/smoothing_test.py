# SPDX-License-Identifier: Apache-2.0
"""Smoothed surfaces and normals, compared with the formulas in NumPy and SciPy."""

import os
import shutil
import tempfile
import unittest

import numpy as np

import terrace

try:
    from scipy.sparse import coo_matrix, diags
except ImportError as missing:
    raise unittest.SkipTest(f'{missing.name} is missing')

RADIUS = 40.0


def noisy_sphere(count=2000, noise=0.8, seed=1):
    """Returns evenly spread points whose distances from the origin differ by up to ``noise``."""
    random = np.random.default_rng(seed)
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    unit = np.column_stack((r * np.cos(angle), r * np.sin(angle), z))
    return unit * (RADIUS + noise * random.uniform(-1, 1, (count, 1)))


def taubin(vertices, triangles, iterations):
    """The same steps with a sparse matrix; all vertices of a closed surface move."""
    ends = triangles[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
    count = len(vertices)
    neighbours = coo_matrix((np.ones(len(ends)), ends.T), (count, count)).tocsr()
    neighbours.data[:] = 1
    mean = diags(1 / np.asarray(neighbours.sum(axis=1)).ravel()) @ neighbours
    for _ in range(iterations):
        for factor in (0.5, 1 / (0.05 - 1 / 0.5)):
            vertices = vertices + factor * (mean @ vertices - vertices)
    return vertices


def bilateral(vertices, triangles, iterations):
    corners = np.repeat(np.arange(len(triangles)), 3), triangles.ravel()
    uses = coo_matrix((np.ones(3 * len(triangles)), corners), (len(triangles), len(vertices))).tocsr()
    around = (uses @ uses.T).tocoo()
    i, j = (part[around.row != around.col] for part in (around.row, around.col))

    def middles(places):
        return places[triangles].mean(axis=1)

    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    normals = normals / areas[:, None]
    apart = np.linalg.norm(middles(vertices)[i] - middles(vertices)[j], axis=1)
    near = areas[j] * np.exp(-apart ** 2 / (2 * apart.mean() ** 2))
    for _ in range(iterations):
        alike = np.exp(-np.sum((normals[i] - normals[j]) ** 2, axis=1) / (2 * 0.35 ** 2))
        weights = coo_matrix((near * alike, (i, j)), (len(triangles),) * 2).tocsr() + diags(areas)
        normals = weights @ normals
        normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    for _ in range(20):
        here, there = corners
        heights = np.sum(normals[here] * (middles(vertices)[here] - vertices[there]), axis=1)
        steps = coo_matrix((heights, (there, here)), (len(vertices), len(triangles))).tocsr() @ normals
        vertices = vertices + steps / np.bincount(there)[:, None]
    return vertices


class Smoothing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix='terrace-smoothing-')
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.store = terrace.build(noisy_sphere(), os.path.join(cls.folder, 'ball'))
        cls.rough = cls.store.surface()

    def test_matches_sparse_matrices(self):
        self.assertTrue(self.rough.measures()['closed'])
        for method, expected in (('taubin', taubin), ('bilateral', bilateral)):
            for iterations in (1, 5):
                mesh = self.rough.smoothed(method, iterations=iterations, limit=np.inf)
                np.testing.assert_array_equal(mesh.triangles, self.rough.triangles)
                np.testing.assert_allclose(mesh.vertices, expected(self.rough.vertices, self.rough.triangles, iterations),
                                           rtol=0, atol=1e-8, err_msg=method)

    def test_surface_of_a_store_is_smoothed_in_the_same_way(self):
        for options in ('taubin', 'bilateral', {'method': 'bilateral', 'iterations': 3, 'limit': 0.5}):
            smooth = self.store.surface(smoothing=options)
            again = self.rough.smoothed(**({'method': options} if isinstance(options, str) else options))
            np.testing.assert_allclose(smooth.vertices, again.vertices, rtol=0, atol=1e-9)
            np.testing.assert_array_equal(smooth.levels, self.rough.levels)
            left, noise = (np.abs(np.linalg.norm(mesh.vertices, axis=1) - RADIUS).mean() for mesh in (smooth, self.rough))
            self.assertLess(left, 0.6 * noise)

    def test_limit_holds_and_threads_do_not_matter(self):
        for method in ('taubin', 'bilateral'):
            mesh = self.rough.smoothed(method, limit=0.1)
            moved = np.sqrt(((mesh.vertices - self.rough.vertices) ** 2).sum(axis=1))
            self.assertLessEqual(moved.max(), 0.1)
            self.assertGreater((moved > 0.0999).mean(), 0.3)
            for threads in (1, 3):
                np.testing.assert_array_equal(self.rough.smoothed(method, limit=0.1, threads=threads).vertices, mesh.vertices)

    def test_rejects_invalid_arguments(self):
        for wrong in (lambda: self.rough.smoothed('laplacian'), lambda: self.rough.smoothed(limit=-1.0), lambda: self.rough.smoothed(limit=np.nan),
                      lambda: self.store.surface(smoothing='best'), lambda: self.store.surface(smoothing='taubin', tetrahedra=True),
                      lambda: terrace.Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]])).smoothed()):
            with self.assertRaises(ValueError):
                wrong()
        with self.assertRaises(TypeError):
            self.store.surface(smoothing={'strength': 1})

    def test_normals(self):
        vertices, triangles = self.rough
        normals = self.rough.normals()
        expected = np.zeros_like(vertices)
        for k in range(3):
            a, b, c = (vertices[triangles[:, (k + i) % 3]] for i in range(3))
            n = np.cross(b - a, c - a)
            cosine = np.sum((b - a) * (c - a), axis=1) / (np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - a, axis=1))
            np.add.at(expected, triangles[:, k], np.arccos(cosine)[:, None] * n / np.linalg.norm(n, axis=1)[:, None])
        np.testing.assert_allclose(normals, expected / np.linalg.norm(expected, axis=1)[:, None], rtol=0, atol=1e-9)
        np.testing.assert_array_equal(self.rough.normals(threads=2), normals)
        path = os.path.join(self.folder, 'ball.obj')
        self.rough.save(path, normals=True)
        with open(path) as file:
            written = np.array([line.split()[1:] for line in file if line.startswith('vn ')], float)
        np.testing.assert_allclose(written, normals, rtol=0, atol=1e-7)
        np.testing.assert_array_equal(terrace.Mesh.read(path).triangles, triangles)


if __name__ == '__main__':
    unittest.main()
