"""The page of a small hand-made result: ratios, goals, losses and what is missing."""

import unittest
from unittest import mock

from goals import PUBLISHED, all_goals
from machine import RUN
from page import page

MACHINE = {
    "cpu": "Abacus", "family": "1", "architecture": "wood", "cores": 2, "features": ["beads"], "memory_gb": 1,
    "system": "Table 1", "date": "2000-01-01", "commit": "0123456789ab", "rustc": "rustc 1", "load_before": 0.0,
}
EMPTY = {"schema": 1, "quick": False, "machine": MACHINE, "versions": {}, "failed": {}, "parts": {}, "minutes": 1}


def trace(workload, tracer, build, trace, threads=2, way="", **more):
    row = {
        "workload": workload, "facets": 1000, "rays": 2000, "threads": threads, "mesh_mb": 10.0, "coherent": True,
        "tracer": tracer, "agree": 1.0, "memory_mb": 4.0, "way": way, "turns": 3,
    }
    parts = {"build": build, "trace": trace, "total": build + trace}
    return row | {name: [0.9 * ms, ms, 1.1 * ms] for name, ms in parts.items()} | more


def ms(value, **more):
    return {"ms": [value, value, value]} | more


class Page(unittest.TestCase):
    def goal(self, results, work, rival=""):
        found = [g for g in all_goals(EMPTY | results) if g.work.startswith(work) and rival in g.goal]
        self.assertEqual(len(found), 1, found)
        return found[0]

    def lines(self, results, start):
        text = page(EMPTY | results)
        self.assertNotIn("None", text)
        return [line for line in text.splitlines() if line.startswith(start)]

    def test_power_is_part_of_the_papers_goal_and_the_fastest_way_counts(self):
        results = {
            "trace": [
                trace("paper", "matdb pinhole", 0.0, 1.0) | {"power": [0.2, 0.25, 0.3], "with_power": [1.1, 1.25, 1.3]},
                trace("paper", "Embree, medium build", 9.0, 4.0, way="single"),
                trace("paper", "Embree, medium build", 9.0, 1.0, way="packets of 16"),
            ],
        }
        goal = self.goal(results, "paper's scan, facets → hits → power", "medium")
        self.assertEqual((goal.measured, goal.reached), ("× 8.00", True))
        results["trace"][0]["with_power"][1] = 1.26
        self.assertFalse(self.goal(results, "paper's scan, facets → hits → power", "medium").reached)
        row, = self.lines(results, "| Embree, medium build, packets of 16 |")
        self.assertIn("| × 10.0 |", row)
        told, = self.lines(results, "2 threads.")
        self.assertIn("takes another 0.250 (0.200–0.300) ms", told)

    def test_the_slower_change_counts_when_a_scan_is_predicted_again(self):
        row = {"threads": 1, "chirps": 18529, "shots": 9000, "traced": [3.0] * 3, "same": [0.1] * 3}
        results = {"reshade": [row | {"law": [0.4, 0.5, 0.6], "effect": [0.9, 1.1, 1.2]}]}
        goal = self.goal(results, "a scan of 18 529 chirps, 9 000 of them")
        self.assertEqual((goal.measured, goal.reached), ("1.10 ms", False))
        self.assertEqual(self.lines(results, "| another law"), ["| another law | 0.500 (0.400–0.600) |"])

    def test_the_slowest_diagnosis_counts(self):
        row = {"hidden": "drift", "diagnose_s": 20.0, "render_s": 0.5, "said": "explained: drift"}
        results = {"diagnosis": [row, row | {"hidden": "pose", "diagnose_s": 61.0}]}
        goal = self.goal(results, "whole diagnosis")
        self.assertEqual((goal.measured, goal.reached), ("61.0 s", False))
        self.assertEqual(self.lines(results, "| drift"), ["| drift | 20.0 | 0.500 | × 40.0 | explained: drift |"])

    def test_the_default_tracer_is_the_measure_and_not_the_faster_one(self):
        results = {
            "trace": [trace("paper", "matdb pinhole", 0.0, 2.0), trace("paper", "matdb hierarchy", 0.5, 0.5)]
        }
        row, = self.lines(results, "| matdb hierarchy |")
        self.assertIn("| × 0.500 |", row)

    def test_a_loss_once_built_is_one_too(self):
        results = {
            "trace": [
                trace("body", "matdb pinhole", 0.0, 2.0),
                trace("body", "Embree, low build", 0.5, 0.5),
                trace("body", "Embree, medium build", 5.0, 1.0),
                trace("body", "Open3D", 5.0, 3.0),
            ],
            "fits": [ms(2.0, fit="f", program="matdb"), ms(1.0, fit="f", program="odrpack", gap=1e-7)],
        }
        row, = self.lines(results, "| 1 000 × 2 000 | 2.00 (1.80–2.20) |")
        self.assertTrue(row.endswith(" | **0.500** / **0.250** | 3.00 / **0.500** |  | 4.00 / 1.50 |  |"), row)
        lost, = self.lines(results, "- **Slower:**")
        self.assertEqual(lost, "- **Slower:** 1 000 × 2 000 (× 0.500); f (× 0.500).")
        once, = self.lines(results, "- **Once built:**")
        self.assertIn("the others trace faster in 2 of 3", once)

    def test_what_is_missing_is_said_and_is_no_loss(self):
        results = {
            "trace": [
                trace("paper", "matdb pinhole", 0.0, 2.0),
                {"workload": "paper", "facets": 1000, "rays": 2000, "threads": 2, "mesh_mb": 10.0,
                 "coherent": True, "tracer": "Open3D", "missing": "No module named 'open3d'"},
            ],
            "failed": {"store": "no cargo"},
        }
        row, = self.lines(results, "| Open3D |")
        self.assertIn("No module named 'open3d'", row)
        row, = self.lines(results, "| 1 000 × 2 000 | 2.00 ")
        self.assertIn("| not installed |", row)
        self.assertEqual(self.lines(results, "- **Slower:**"), ["- **Slower:** nowhere in this run."])
        self.assertEqual(self.lines(results, "- store"), ["- store could not be measured: no cargo"])

    def test_parts_of_another_run_tell_when_it_was(self):
        run = {key: MACHINE[key] for key in RUN}
        other = run | {"date": "1999-12-31", "commit": "ba9876543210", "load_before": 1.5}
        results = {
            "parts": {
                "trace": run | {"minutes": 7.0},
                "fits": other | {"minutes": 3.0},
                "render": other | {"minutes": 1.0},
                "store": other | {"minutes": 42.2, "cpu": "Slide rule"},
            },
        }
        told = "measured on 1999-12-31 at `ba9876543210`, {} minutes, load before them 1.5"
        self.assertEqual(self.lines(results, "- trace"), [])
        self.assertEqual(self.lines(results, "- fits"), ["- fits, render: " + told.format(4)])
        self.assertEqual(self.lines(results, "- store"), ["- store: " + told.format(42) + ", by Slide rule"])

    def test_registration_must_be_faster_than_the_fastest_and_as_exact(self):
        results = {"registration": [
            ms(50.0, threads=2, program="matdb, whole", shift_mm=0.05, turn_deg=0.03, points=9),
            ms(60.0, threads=2, program="small_gicp ICP", shift_mm=4.0, turn_deg=0.6),
            ms(40.0, threads=2, program="small_gicp GICP", shift_mm=0.1, turn_deg=0.1),
        ]}
        self.assertEqual(self.goal(results, "registration, 2 threads", "small_gicp").measured, "× 0.800")
        self.assertIsNone(self.goal(results, "registration, 1 thread", "Open3D").reached)
        self.assertTrue(self.goal(results, "registration, error of the shift").reached)
        self.assertFalse(self.goal(results, "registration, error of the turn").reached)

    def test_the_slowest_question_to_the_database_counts(self):
        rows = [("filter by tag", 20.0), ("filter by kind", 1200.0), ("full text `no77`", 300.0)]
        results = {"store": [{"what": what, "value": us, "unit": "us", "goal": 1000.0} for what, us in rows]}
        goal = self.goal(results, "database: the slowest filter")
        self.assertEqual((goal.measured, goal.reached), ("1 200 µs", False))

    def test_memory_counts_the_mesh_itself(self):
        results = {"trace": [trace("facets 7", "matdb pinhole", 0.0, 1.0)]}
        self.assertEqual(self.goal(results, "memory, 10 M facets, mesh included, pinhole").measured, "1.40 × the mesh")
        self.assertIsNone(self.goal(results, "memory, 10 M facets, mesh included, hierarchy").reached)

    def test_a_goal_is_held_against_the_fastest_of_a_rivals_ways(self):
        ms = {"matdb": 2.0, "scipy least_squares": 20.0, "scipy curve_fit": 10.0}
        rows = [{"fit": "least squares", "program": program, "ms": [ms] * 3} for program, ms in ms.items()]
        self.assertEqual(self.goal({"fits": rows}, "least squares", "scipy").measured, "× 5.00")

    def test_a_gpu_that_was_measured_is_told_and_held_against_what_is_published(self):
        row = {"adapter": "Loom", "threads": 2, "facets": 20, "hold": [1.0] * 3, "hits": [9.0] * 3}
        results = {"gpu": [row | {"rays": 10_000, "answers": [1.0] * 3}, row | {"rays": 10**6, "answers": [4.0, 5.0, 6.0]}]}
        goal = self.goal(results, "GPU")
        self.assertEqual((goal.measured, goal.verdict()), ("200 million rays/s by Loom", "no rate published"))
        for published, reached in [(400, True), (401, False)]:
            with mock.patch.dict(PUBLISHED, {"Loom": published}):
                self.assertIs(self.goal(results, "GPU").reached, reached)
        self.assertEqual(self.lines(results, "| 20 | 1 000 000 |"), [
            "| 20 | 1 000 000 | 2 | 1.00 | 5.00 (4.00–6.00) | 200 | 9.00 |"
        ])
        self.assertNotIn("No GPU was available", page(EMPTY | results))

    def test_labelled_scans_are_held_against_their_goal_and_the_other_program(self):
        results = {"datasets": {"scans": 16, "rays": 64, "matdb_cpu_s": 0.1, "other_cpu_s": 0.2, "s": [0.1, 0.05]}}
        goal = self.goal(results, "labelled scans")
        self.assertEqual((goal.measured, goal.reached), ("10.0 a second", True))
        self.assertEqual(self.lines(results, "| Embree and numpy"), ["| Embree and numpy | 0.200 | × 2.00 |"])
        won, = self.lines(results, "- **Faster:**")
        self.assertEqual(won, "- **Faster:** labelled scans of a data set, 1 core (× 2.00).")
        results["datasets"]["matdb_cpu_s"] = 0.2
        self.assertFalse(self.goal(results, "labelled scans").reached)

    def test_a_page_without_results_names_every_goal_as_not_measured(self):
        for goal in all_goals(EMPTY):
            self.assertIsNone(goal.reached, goal)
        self.assertIn("No GPU was available", page(EMPTY))


if __name__ == "__main__":
    unittest.main()
