"""MCAP files of replays, read by PyPI's mcap: complete, indexed, with Foxglove's schemas, and the same numbers as the
page.

Run by ctest: python3 mcap_test.py PICTURA [unittest arguments]. Skipped without mcap (requirements.txt).
"""

import base64
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import page_test

try:
    from mcap.reader import NonSeekingReader, SeekingReader
except ImportError:
    SeekingReader = None

PICTURA = ""

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}


def differences(value, schema, path=""):
    """Returns differences between a value and its schema, as (what, where) of members: undeclared, missing, or of
    another type.
    """
    is_true_or_false = isinstance(value, bool)  # a bool is a number in Python
    if is_true_or_false != (schema["type"] == "boolean") or not isinstance(value, TYPES[schema["type"]]):
        return {("type", path)}
    found = set()
    if schema["type"] == "object":
        declared = schema["properties"]
        found |= {("undeclared", f"{path}.{name}") for name in value.keys() - declared.keys()}
        found |= {("lacking", f"{path}.{name}") for name in declared.keys() - value.keys()}
        for name in value.keys() & declared.keys():
            found |= differences(value[name], declared[name], f"{path}.{name}")
    if schema["type"] == "array":
        for member in value:
            found |= differences(member, schema["items"], path)
    return found


@unittest.skipIf(SeekingReader is None, "needs PyPI's mcap: scripts/setup installs it")
class Mcap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls._folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        cls.addClassCleanup(cls._folder.cleanup)
        folder = pathlib.Path(cls._folder.name)
        cls.path = folder / "drive.mcap"
        subprocess.run([PICTURA, "replay", "procedural:1:blocks=2x2", "--agents", "20", "--steps", "80", "--policy", "random", "--seed", "3", "--follow", "4",
                        "--cameras", "--mcap", cls.path, "--out", folder / "drive.html"], check=True, capture_output=True, timeout=600)  # fmt: skip
        cls.page = page_test.Recorded(folder / "drive.html")
        cls.messages = {}
        with open(cls.path, "rb") as file:
            for schema, channel, message in SeekingReader(file, validate_crcs=True).iter_messages():
                cls.messages.setdefault(channel.topic, []).append((schema, message.log_time, json.loads(message.data)))

    def test_topics_and_schemas(self):
        schemas = {topic: messages[0][0].name for topic, messages in self.messages.items()}
        cameras = {f"/camera/{name}": "foxglove.CompressedImage" for name in (c["name"] for c in self.page.header["cameras"])}
        self.assertEqual(schemas, {"/map": "foxglove.SceneUpdate", "/agents": "foxglove.SceneUpdate", "/lights": "foxglove.SceneUpdate",
                                   "/events": "foxglove.Log", "/agent": "pictura.Agent", **cameras})  # fmt: skip

    def test_messages_match_their_schemas(self):
        # A scene contains only what it draws, and random actions have no probabilities.
        parts = {".entities." + name for name in ("cubes", "spheres", "lines", "texts")}
        absent = {"/map": parts - {".entities.lines"}, "/agents": parts - {".entities.cubes", ".entities.texts"}, "/lights": parts - {".entities.spheres"},
                  "/agent": {".probabilities", ".value"}}  # fmt: skip
        for topic, messages in self.messages.items():
            schema, wanted = json.loads(messages[0][0].data), {("lacking", path) for path in absent.get(topic, ())}
            for _, _, message in messages:
                self.assertEqual(differences(message, schema), wanted, topic)
        self.assertEqual(set(self.messages["/agent"][0][2]), {"agent", *self.page.tracks})

    def test_differences_between_schemas_and_messages_are_found(self):
        point = {"type": "object", "properties": {"x": {"type": "number"}}}
        schema = {"type": "object", "properties": {"points": {"type": "array", "items": point}, "name": {"type": "string"}}}
        for message, wanted in [
            ({"points": [{"x": 1}], "name": "a"}, set()),
            ({"points": [{"x": 1}, {"x": 2, "y": 3}], "name": "a"}, {("undeclared", ".points.y")}),
            ({"points": [{}]}, {("lacking", ".points.x"), ("lacking", ".name")}),
            ({"points": [{"x": True}], "name": 1}, {("type", ".points.x"), ("type", ".name")}),
        ]:
            self.assertEqual(differences(message, schema), wanted)

    def test_agents_have_the_poses_of_the_page(self):
        tracks = self.page.tracks
        for frame, (_, time_ns, scene) in enumerate(self.messages["/agents"]):
            self.assertEqual(time_ns, frame * 100_000_000)
            entity = scene["entities"][0]
            there = [a for a in range(20) if round(tracks["status"][a][frame]) != 3]
            self.assertEqual([text["text"] for text in entity["texts"]], [str(a) for a in there])
            for agent, cube in zip(there, entity["cubes"][-len(there) :]):
                position, turn = cube["pose"]["position"], cube["pose"]["orientation"]
                self.assertAlmostEqual(position["x"], tracks["x_m"][agent][frame], 6)
                self.assertAlmostEqual(position["y"], tracks["y_m"][agent][frame], 6)
                heading = math.radians(tracks["heading_deg"][agent][frame])
                self.assertAlmostEqual(math.cos(2 * math.atan2(turn["z"], turn["w"]) - heading), 1, 6)
        self.assertEqual(len(self.messages["/agents"]), 81)

    def test_lights_have_their_colours(self):
        seen = {tuple(sphere["color"][name] for name in "rgb") for _, _, scene in self.messages["/lights"] for sphere in scene["entities"][0]["spheres"]}
        self.assertLessEqual({(1, 0, 0), (0, 1, 0)}, seen)

    def test_the_followed_agent_and_its_images(self):
        speeds = [message["speed_mps"] for _, _, message in self.messages["/agent"]]
        for speed, recorded in zip(speeds, self.page.tracks["speed_mps"][4], strict=True):
            self.assertAlmostEqual(speed, recorded, 6)
        images = self.messages["/camera/front"]
        self.assertEqual(len(images), 81)
        width, height, rows = page_test.png_pixels(base64.b64decode(images[40][2]["data"]))
        self.assertEqual((width, height), (96, 54))
        self.assertGreater(len({row[3 * x : 3 * x + 3] for row in rows for x in range(width)}), 5)

    def test_every_infraction_and_goal_is_an_event(self):
        wanted = [frame for column in self.page.tracks["events"] for frame, bits in enumerate(column) if round(bits) & (1 | 4 | 8 | 16 | 128)]
        times = sorted(time_ns // 100_000_000 for _, time_ns, _ in self.messages["/events"])
        self.assertEqual(times, sorted(wanted))
        self.assertGreater(len(times), 0)
        origin = self.page.header["origin_m"]
        for _, time_ns, message in self.messages["/events"]:
            agent, x, y = re.match(r"agent (\d+) at \((\S+), (\S+)\): ", message["message"]).groups()
            frame = time_ns // 100_000_000
            self.assertAlmostEqual(float(x), self.page.tracks["x_m"][int(agent)][frame] + origin[0], 1)
            self.assertAlmostEqual(float(y), self.page.tracks["y_m"][int(agent)][frame] + origin[1], 1)

    def test_the_summary_matches_the_messages(self):
        with open(self.path, "rb") as file:
            reader = SeekingReader(file)
            summary = reader.get_summary()
            metadata = list(reader.iter_metadata())
        count = sum(len(messages) for messages in self.messages.values())
        self.assertEqual(summary.statistics.message_count, count)
        self.assertEqual(summary.statistics.message_end_time, 8_000_000_000)
        self.assertEqual(sum(summary.statistics.channel_message_counts.values()), count)
        self.assertGreater(len(summary.chunk_indexes), 1)
        with open(self.path, "rb") as file:
            self.assertEqual(sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages()), count)
        self.assertEqual(summary.statistics.metadata_count, len(metadata))
        self.assertEqual(metadata[0].metadata["light_cycles"], "phases")
        with open(self.path, "rb") as file:
            between = list(SeekingReader(file).iter_messages(topics=["/agent"], start_time=2_000_000_000, end_time=3_000_000_000))
        self.assertEqual(len(between), 10)


if __name__ == "__main__":
    PICTURA = sys.argv.pop(1)
    unittest.main()
