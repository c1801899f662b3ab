"""Pretrained backbones: scripts/export_backbone, and training and evaluation with its programs.

Run by ctest: python3 backbone_test.py PICTURA [unittest arguments], by a Python that has torch.
"""

import json
import multiprocessing
import os
import pathlib
import runpy
import struct
import subprocess
import sys
import tempfile
import unittest

import torch  # noqa: F401: children of this process, which export, have it then

import command_case

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXPORT = ROOT / "scripts" / "export_backbone"
TRAIN = [
    "train", "--config", ROOT / "configs" / "smoke.toml",
    "--set", "simulator.num_slots=6", "--set", "simulator.min_agents=3", "--set", "simulator.max_agents=3",
    "--set", "train.num_steps=8", "--set", "train.minibatch_size=48", "--set", "train.schedule_agent_steps=1000000",
    "--set", "train.learning_rate=0.01", "--set", "render.width_px=20", "--set", "render.height_px=9",
    "--set", "run.num_threads=1", "--set", "run.device=cpu",
]  # fmt: skip

# For images of any size: a class token and positions from sines.
MODELS = """
import torch
from torch import nn


class Vit(nn.Module):
    def __init__(self, seed):
        super().__init__()
        torch.manual_seed(seed)
        self.patches = nn.Conv2d(3, 16, 8, 8)
        self.start = nn.Parameter(torch.randn(1, 1, 16))
        layer = nn.TransformerEncoderLayer(16, 2, 32, 0.1, batch_first=True, norm_first=True)
        self.layers = nn.TransformerEncoder(layer, 2, enable_nested_tensor=False)

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        tokens = self.patches(images).flatten(2).transpose(1, 2)
        place = torch.arange(tokens.size(1), device=tokens.device).unsqueeze(1) / torch.arange(1, 17, device=tokens.device)
        tokens = torch.cat([self.start.expand(tokens.size(0), 1, 16), tokens + place.sin()], 1)
        return self.layers(tokens)


class Unscriptable(Vit):
    def forward(self, images):
        return Vit.forward(self, images, *())


def make():
    return Vit(1)


def make_other():
    return Vit(2)


def make_unscriptable():
    return Unscriptable(1)
"""


def export(words, stdout, stderr):
    os.dup2(stdout, 1)
    os.dup2(stderr, 2)
    sys.argv = words
    runpy.run_path(words[0], run_name="__main__")


def run_export(*arguments):
    """Runs scripts/export_backbone in a child of this process, since importing torch takes seconds."""
    words = [str(EXPORT), *map(str, arguments)]
    with tempfile.TemporaryFile("w+") as stdout, tempfile.TemporaryFile("w+") as stderr:
        child = multiprocessing.get_context("fork").Process(target=export, args=(words, stdout.fileno(), stderr.fileno()))
        child.start()
        child.join(300)
        stdout.seek(0)
        stderr.seek(0)
        return subprocess.CompletedProcess(words, child.exitcode, stdout.read(), stderr.read())


def run(program, *arguments):
    return run_export(*arguments) if program == EXPORT else command_case.run(program, *arguments)


class Backbones(unittest.TestCase):
    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        self.folder = pathlib.Path(self._folder.name)
        (self.folder / "models.py").write_text(MODELS)

    def tearDown(self):
        self._folder.cleanup()

    def export(self, function, name, *more):
        result = run(EXPORT, f"{self.folder}/models.py:{function}", "--patch", 8, "--out",
                     self.folder / name, *more)  # fmt: skip
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def train(self, program, name, updates, *more):
        return [*TRAIN, "--set", f"policy.backbone={program}", "--set", f"train.updates={updates}", "--out",
                self.folder / name, *more]  # fmt: skip

    def json_of(self, *arguments):
        result = run(*arguments, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def assert_refused(self, messages, *arguments):
        result = run(*arguments)
        self.assertNotEqual(result.returncode, 0, result.stdout)
        for message in messages:
            self.assertIn(message, result.stderr)
        self.assertNotIn("Traceback", result.stderr)

    def weights(self, name):
        """Returns the weights of a run, by name, as bytes."""
        data = (self.folder / name / "policy.safetensors").read_bytes()
        (length,) = struct.unpack("<Q", data[:8])
        header = json.loads(data[8 : 8 + length])
        begin = 8 + length
        return {key: data[begin + entry["data_offsets"][0] : begin + entry["data_offsets"][1]]
                for key, entry in header.items() if key != "__metadata__"}  # fmt: skip

    def test_a_frozen_backbone_is_not_saved_but_affects_the_policy(self):
        vit, other = self.export("make", "vit.pt"), self.export("make_other", "other.pt")
        whole = self.json_of(*self.train(vit, "whole", 2))
        weights = self.weights("whole")
        self.assertFalse([name for name in weights if name.startswith(("image_backbone.", "conv."))])
        self.assertEqual(len(weights["attention.key.weight"]), 4 * 16 * 16)
        self.json_of(*self.train(vit, "parts", 1))
        self.assert_refused(["checkpoint.ckpt", "policy.backbone", "a program of hash"],
                            *self.train(other, "parts", 2, "--resume"))  # fmt: skip
        self.assert_refused(["checkpoint.ckpt", "policy.backbone", '"conv"'],
                            *self.train("conv", "parts", 2, "--resume"))  # fmt: skip
        moved = vit.rename(self.folder / "moved.pt")
        self.assertEqual(self.json_of(*self.train(moved, "parts", 2, "--resume"))["policy_hash"], whole["policy_hash"])
        self.assertNotEqual(self.json_of(*self.train(other, "other", 2))["policy_hash"], whole["policy_hash"])

        evaluate = ["evaluate", self.folder / "whole" / "checkpoint.ckpt", "--map", "procedural", "--agents", 4,
                    "--scenarios", 1, "--steps", 4, "--device", "cpu", "--threads", 1]  # fmt: skip
        self.assert_refused([str(vit)], *evaluate)
        self.assert_refused(["policy.backbone"], *evaluate, "--backbone", other)
        self.assertGreater(self.json_of(*evaluate, "--backbone", moved)["agent_steps"], 0)
        # Images of any size.
        self.assertGreater(self.json_of(*evaluate, "--backbone", moved, "--size", "33x17")["agent_steps"], 0)

    def test_a_trained_backbone_is_learnt_saved_and_resumed(self):
        vit = self.export("make", "vit.pt")
        trained = ["--set", "policy.backbone_frozen=false"]
        whole = self.json_of(*self.train(vit, "whole", 2, *trained))
        self.json_of(*self.train(vit, "parts", 1, *trained))
        first = self.weights("parts")
        self.assertEqual(self.json_of(*self.train(vit, "parts", 2, *trained, "--resume"))["policy_hash"],
                         whole["policy_hash"])  # fmt: skip
        names = [name for name in first if name.startswith("image_backbone.model.layers.")]
        self.assertEqual(len(names), 24)
        for name in ["image_backbone.model.start", *names]:
            self.assertNotEqual(first[name], self.weights("parts")[name], name)
        self.assert_refused(["policy.backbone_frozen: false became true"], *self.train(vit, "parts", 3, "--resume"))

    def test_errors_name_bad_backbones(self):
        text = self.folder / "text.pt"
        text.write_text("no program")
        self.assert_refused([str(text), "TorchScript"], *self.train(text, "run", 1))
        self.assert_refused(["none.pt"], *self.train(self.folder / "none.pt", "run", 1))
        export = [EXPORT, f"{self.folder}/models.py:make_unscriptable", "--patch", 8, "--out",
                  self.folder / "traced.pt"]  # fmt: skip
        self.assert_refused(["cannot be scripted", "--size"], *export)
        traced = self.export("make_unscriptable", "traced.pt", "--size", "24x16")
        self.assertGreater(self.json_of(*self.train(traced, "traced", 1))["agent_steps"], 0)
        self.assert_refused(["traced.pt", "24x16", "40x16", "'front'"],
                            *self.train(traced, "larger", 1, "--set", "render.width_px=40", "--set",
                                        "render.height_px=16"))  # fmt: skip
        self.assert_refused(["traced.pt", "24x16", "48x32"],
                            *self.train(traced, "later", 1, "--set", "render.schedule=[[100000, 48, 32]]"))  # fmt: skip
        vit = self.export("make", "vit.pt")
        self.assert_refused(["16 channels", "policy.attention_heads (3)"],
                            *self.train(vit, "heads", 1, "--set", "policy.attention_heads=3"))  # fmt: skip
        self.assert_refused(["--patch 7", " tokens"], EXPORT, f"{self.folder}/models.py:make", "--patch", 7,
                            "--out", self.folder / "none.pt")  # fmt: skip
        for patch, size in (4, []), (16, []), (16, ["--size", "64x64"]):
            self.assert_refused([f"--patch {patch}", " tokens"], EXPORT, f"{self.folder}/models.py:make", "--patch",
                                patch, *size, "--out", self.folder / "none.pt")  # fmt: skip


if __name__ == "__main__":
    unittest.main(verbosity=2)
