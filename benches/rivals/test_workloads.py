"""Workloads and the comparison of hits; needs NumPy."""

import unittest

try:
    import numpy as np

    from files import NONE
    from tracing import agreement, unsorted
    from workloads import ORIGIN_M, ball, mirrored, order, square
except ModuleNotFoundError as reason:
    raise unittest.SkipTest(str(reason)) from reason


class Workloads(unittest.TestCase):
    def test_a_ball_is_closed_but_for_its_poles_and_faces_outwards(self):
        vertices, facets = ball(10**4)
        self.assertEqual(len(facets), 10**4)
        edges = np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]])
        _, counts = np.unique(np.sort(edges, 1), axis=0, return_counts=True)
        self.assertEqual((counts == 1).sum(), 2 * 100)
        self.assertTrue((counts <= 2).all())
        a, b, c = (vertices[facets[:, corner]] for corner in range(3))
        outwards = (np.cross(b - a, c - a) * ((a + b + c) / 3 - [0, 1.1, 0])).sum(1)
        self.assertTrue((outwards > 0).all() or (outwards < 0).all())

    def test_rays_keep_their_origin_and_every_ray_is_sorted_once(self):
        rays = square(900)
        self.assertTrue((rays[:, :3] == ORIGIN_M).all())
        self.assertTrue(np.allclose(np.linalg.norm(rays[:, 3:], axis=1), 1))
        places = order(rays)
        self.assertTrue((np.sort(places) == np.arange(900)).all())
        ordered = rays[places]
        step = lambda rays: np.linalg.norm(np.diff(rays[:, 3:], axis=0), axis=1)
        self.assertLess(np.median(step(ordered)), 1.01 * np.median(step(rays)))
        back, _ = unsorted((np.arange(900)[places], np.zeros(900)), places)
        self.assertTrue((back == np.arange(900)).all())

    def test_a_mirror_sends_back_what_meets_it_straight_and_starts_above(self):
        vertices = np.array([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]])
        along = np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.0, 0.0, 1.0]])
        rays = np.hstack([np.tile([0.0, 0.0, 8.0], (3, 1)), along])
        hits = np.array([0, 0, NONE], "<u4"), np.array([8.0, 10.0, np.inf])
        found = mirrored(vertices, np.array([[0, 1, 2]], "<u4"), rays, hits)
        self.assertTrue(np.allclose(found, [[0, 0, 1e-3, 0, 0, 1], [6, 0, 1e-3, 0.6, 0, 0.8]]))

    def test_hits_agree_by_facet_by_range_or_by_missing_both(self):
        ours = np.array([1, 2, 3, NONE, NONE], "<u4"), np.array([8.0, 8.0, 8.0, np.inf, np.inf])
        theirs = np.array([1, 9, 9, NONE, 4], "<u4"), np.array([8.1, 8.000001, 8.0001, np.inf, 8.0])
        self.assertEqual(agreement(ours, theirs), 3 / 5)


if __name__ == "__main__":
    unittest.main()
