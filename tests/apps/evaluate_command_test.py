"""`pictura evaluate` and `export` from outside."""

import shutil
import unittest

from command_case import TINY, CommandCase, run


class Evaluation(CommandCase):
    def test_exported_weights_and_checkpoint_drive_identically(self):
        run_folder, weights = self.folder / "run", self.folder / "weights.safetensors"
        trained = self.json_of("train", *TINY, "--set", "train.updates=1", "--out", run_folder)
        whole = self.json_of("export", run_folder / "checkpoint.ckpt", "--weights", "f32", "--out", weights)
        self.assertEqual(whole["policy_hash"], trained["policy_hash"])
        self.assertEqual((whole["updates"], whole["agent_steps"]), (1, trained["agent_steps"]))
        self.assertEqual(weights.stat().st_size, whole["bytes"])
        drive = ["simulate", "procedural:1", "--agents", 4, "--steps", 20, "--policy"]
        expected = self.json_of(*drive, run_folder / "checkpoint.ckpt")
        got = self.json_of(*drive, weights)
        self.assertEqual(got["state_hash"], expected["state_hash"])
        half = self.json_of("export", weights, "--out", self.folder / "half.safetensors")
        self.assertLess(half["bytes"], whole["bytes"] - 1.9 * half["parameters"])
        self.assert_refused(1, "weights.safetensors", "train", *TINY, "--init-from", weights,
                            "--set", "policy.backbone_width=8", "--out", self.folder / "other")
        self.assert_refused(1, "none.ckpt", "export", "none.ckpt", "--out", self.folder / "x.safetensors")
        self.assert_refused(2, ".safetensors", "export", weights, "--out", self.folder / "x.bin")

    def test_a_policy_is_exported_for_larger_images(self):
        checkpoint, larger = self.folder / "run" / "checkpoint.ckpt", self.folder / "larger.safetensors"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", self.folder / "run")
        exported = self.json_of("export", checkpoint, "--size", "48x27", "--weights", "f32", "--out", larger)
        small = self.json_of("export", checkpoint, "--weights", "f32", "--out", self.folder / "small.safetensors")
        self.assertGreater(exported["parameters"], small["parameters"])
        self.json_of("simulate", "procedural:1", "--agents", 4, "--steps", 5, "--policy", larger)
        at_its_size = [*TINY, "--set", "render.width_px=48", "--set", "render.height_px=27", "--set", "train.updates=1"]
        begin = ["train", *at_its_size, "--init-from", larger]
        self.json_of(*begin, "--set", "policy.patch_px=3", "--out", self.folder / "next")
        self.assert_refused(1, "'conv.0.weight'", *begin, "--out", self.folder / "other")
        for size, expected in ("40x27", "integer multiple of 16x9, got 40x27"), ("many", "--size"):
            self.assert_refused(2, expected, "export", checkpoint, "--size", size, "--out", self.folder / "x.safetensors")

    def test_an_evaluation_in_parts_is_merged_exactly(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        evaluate = ["evaluate", out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 4,
                    "--steps", 5, "--out"]  # fmt: skip
        paths = {name: self.folder / f"{name}.json" for name in ["whole", "a", "b", "merged"]}
        whole = self.json_of(*evaluate, paths["whole"], "--scenarios", 3)["rows"]
        self.json_of(*evaluate, paths["a"], "--scenarios", 1)
        self.json_of(*evaluate, paths["b"], "--scenarios", "1:3")
        merged = self.json_of("evaluate", "--merge", paths["b"], paths["a"], "--out", paths["merged"])["rows"]
        self.assertEqual(merged, whole)
        self.assertEqual(paths["merged"].read_bytes(), paths["whole"].read_bytes())
        self.assertIn("goals_per_vehicle_half_width_95", whole[0])
        self.assert_refused(1, "expected 3", "evaluate", "--merge", paths["whole"], paths["b"])
        for option in (["--density", "light"], ["--sampled"], ["--infractions", "all.csv"]):
            self.assert_refused(2, f"{option[0]}: has no effect with --merge", "evaluate", "--merge", paths["a"], *option)
        for x_m, path, scenarios in ((1.5, paths["a"], "0:1"), (2, paths["b"], "1:2")):
            rig = self.folder / "rig.toml"
            rig.write_text("".join(f"[[camera]]\nname = 'c{i}'\nwidth_px = 16\nheight_px = 9\nfocal_px = 9\nx_m = {x_m}\nz_m = 1.5\n" for i in range(4)))
            self.json_of(*evaluate, path, "--scenarios", scenarios, "--rig", rig)
        self.assert_refused(1, "b.json: cameras_hash is", "evaluate", "--merge", paths["a"], paths["b"])
        self.assert_refused(2, "--scenarios", *evaluate, paths["a"], "--scenarios", "3:3")

    def test_controllers_are_evaluated_like_policies(self):
        evaluate = ["evaluate", "--map", "procedural:1", "--agents", 12, "--scenarios", 2, "--steps", 300]
        lane = self.json_of(*evaluate, "--policy", "lane")
        self.assertEqual((lane["checkpoint"], lane["controller"], lane["device"]), (None, "lane", "cpu"))
        self.assertGreater(lane["rows"][0]["goals_per_vehicle"], 0)
        self.assertEqual(lane["rows"][0]["red_light_rate"], 0)
        alone = self.json_of(*evaluate, "--policy", "lane", "--light-cycles", "independent")
        self.assertEqual((lane["light_cycles"], alone["light_cycles"]), ("phases", "independent"))
        self.assertNotEqual(lane["rows"], alone["rows"])
        idle = self.json_of(*evaluate, "--policy", "idle", "--device", "cpu")
        self.assertEqual(idle["rows"][0]["km_driven"], 0)
        # Evaluates in parts, in the world of a checkpoint, here without cyclists and pedestrians.
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--set", "simulator.pedestrian_fraction=0", "--set",
                     "simulator.cyclist_fraction=0", "--out", out)  # fmt: skip
        parts = [self.folder / "a.json", self.folder / "b.json"]
        for path, scenarios in zip(parts, ["0:1", "1:2"]):
            self.json_of("evaluate", out / "checkpoint.ckpt", *evaluate[1:-4], "--steps", 300, "--policy", "lane",
                         "--scenarios", scenarios, "--out", path)  # fmt: skip
        merged = self.json_of("evaluate", "--merge", *parts)
        self.assertEqual(merged["rows"][0]["vehicle_episodes"], 24)
        # Rejects parts of another world, and of a map that has changed.
        self.json_of(*evaluate[:-4], "--steps", 300, "--policy", "lane", "--scenarios", "1:2", "--out", parts[1])
        self.assert_refused(1, "b.json: config.simulator.cyclist_fraction is", "evaluate", "--merge", *parts)
        town = self.town()
        for seed, path, scenarios in zip((3, 4), parts, ("0:1", "1:2")):
            town.write_bytes(self.town(seed=seed).read_bytes())
            self.json_of("evaluate", "--map", town, "--agents", 4, "--steps", 5, "--policy", "idle", "--scenarios", scenarios, "--out", path)
        self.assert_refused(1, "b.json: maps_hash is", "evaluate", "--merge", *parts)
        self.assert_refused(2, "random, idle, lane, idm_lanes, log, inverse, idm; got 'pilot'", *evaluate, "--policy", "pilot")
        self.assert_refused(2, "random, idle, lane, idm_lanes; got 'log'", *evaluate, "--policy", "log")
        self.assert_refused(2, "excludes", *evaluate, "--policy", "lane", "--sampled")
        self.assert_refused(2, "lane reads no images", *evaluate, "--policy", "lane", "--renderer", "cpu")
        self.assert_refused(2, "expected a CHECKPOINT, --policy, or --merge", *evaluate)

    def test_evaluation_uses_the_world_settings_of_training(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--set", "simulator.walls=true",
                     "--set", "simulator.wall_seed=9", "--set", "simulator.parked_cars=2",
                     "--set", "simulator.light_heads=visible", "--out", out)  # fmt: skip
        drive = ["simulate", "procedural:1", "--agents", 4, "--steps", 5, "--policy", out / "checkpoint.ckpt"]
        driven = self.json_of(*drive)
        self.assertEqual((driven["wall_seed"], driven["parked_asked"], driven["light_cycles"], driven["light_heads"]), (9, 2, "phases", "visible"))
        self.assertEqual(self.json_of(*drive, "--light-cycles", "independent")["light_cycles"], "independent")
        self.assertEqual(self.json_of(*drive, "--light-heads", "as_mapped")["light_heads"], "as_mapped")
        self.assertEqual(self.json_of(*drive, "--no-walls")["wall_seed"], None)
        self.assertEqual(self.json_of(*drive, "--renderer", "null")["renderer"], "null")
        if shutil.which("ffmpeg"):
            self.json_of(*drive, "--video", self.folder / "drive.mp4")
            self.assertGreater((self.folder / "drive.mp4").stat().st_size, 2000)

    def test_the_average_of_weights_is_evaluated_and_exported(self):
        out, exported = self.folder / "run", self.folder / "average.safetensors"
        trained = self.json_of("train", *TINY, "--set", "train.updates=2", "--set", "train.weight_average=2", "--out", out)
        report = self.json_of("export", out / "checkpoint.ckpt", "--average", "--weights", "f32", "--out", exported)
        small = ["--map", "procedural:1", "--agents", 4, "--scenarios", 1, "--steps", 5, "--device", "cpu"]
        hashes = {report["policy_hash"], *(self.json_of("evaluate", *policy, *small)["policy_hash"] for policy in (
            [out / "checkpoint.ckpt", "--average"], [out / "policy_average.safetensors"], [exported]))}  # fmt: skip
        self.assertEqual(len(hashes), 1, hashes)
        self.assertNotIn(trained["policy_hash"], hashes)
        self.assert_refused(1, "policy.safetensors: holds one set of weights", "evaluate", out / "policy.safetensors", "--average", *small)
        self.assert_refused(2, "--policy excludes --average", "evaluate", "--policy", "lane", "--average", *small)

    def test_severities_of_randomized_cameras_are_rows(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        # Sampled, so that a policy's observations matter before it has learned to drive.
        small = [out / "checkpoint.ckpt", "--map", "procedural:1", "--agents", 20, "--steps", 60, "--sampled", "--device", "cpu"]
        drive = [*small, "--scenarios", 2]
        rows = self.json_of("evaluate", *drive, "--camera-severity", "0,0.5,2")["rows"]
        self.assertEqual([row.pop("camera_severity") for row in rows], [0, 0.5, 2])
        (plain,) = self.json_of("evaluate", *drive)["rows"]
        self.assertEqual(plain.pop("camera_severity"), 0)
        self.assertEqual(rows[0], plain)
        self.assertNotEqual(rows[2], plain)
        (shaken,) = self.json_of("evaluate", *drive, "--camera-severity", 2, "--out", self.folder / "a.json")["rows"]
        self.assertEqual(shaken.pop("camera_severity"), 2)
        self.assertEqual(shaken, rows[2])
        # Parts of other severities are not merged.
        self.json_of("evaluate", *small, "--scenarios", "2:3", "--out", self.folder / "b.json")
        self.assert_refused(1, "b.json: camera_severity is 0.0, in", "evaluate", "--merge", self.folder / "a.json", self.folder / "b.json")
        (again,) = self.json_of("evaluate", "--merge", self.folder / "a.json")["rows"]
        self.assertEqual(again["camera_severity"], 2)
        table = run("evaluate", *drive, "--camera-severity", "0,1").stdout
        self.assertIn("custom, severity 1\n", table)
        several = ["evaluate", *drive, "--camera-severity", "0,1"]
        self.assert_refused(2, "with several values of --camera-severity", *several, "--out", self.folder / "c.json")
        self.assert_refused(2, "--camera-severity", "evaluate", *drive, "--camera-severity", 3)
        self.assert_refused(2, "--policy excludes --camera-severity", "evaluate", "--policy", "lane", "--camera-severity", 1)

    def test_evaluation_has_its_keys(self):
        out = self.folder / "run"
        self.json_of("train", *TINY, "--set", "train.updates=1", "--out", out)
        result = self.json_of("evaluate", "--map", "procedural:1", out / "checkpoint.ckpt", "--agents", 8,
                              "--scenarios", 2, "--steps", 40, "--device", "cpu")  # fmt: skip
        keys = """density scenarios steps at_fault_collision_rate off_road_rate red_light_rate goals_per_vehicle
                  collision_rate wall_contact_rate km_per_infraction km_per_at_fault_infraction km_driven""".split()
        self.assertEqual([key for key in keys if key not in result["rows"][0]], [])


if __name__ == "__main__":
    unittest.main()
