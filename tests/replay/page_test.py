"""Replays and galleries in headless browsers: no error, something drawn, and recorded objects shown at their positions.

Run by ctest, one entry per class: python3 page_test.py PICTURA [unittest arguments]. Classes whose browser is not
installed are skipped.
"""

import base64
import json
import math
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import browsers

PICTURA = ""


def png_pixels(png):
    """Returns (width, height, rows of RGB bytes) of an 8-bit RGB or RGBA PNG."""
    at, parts, width, height, channels = 8, [], 0, 0, 3
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, _, color = struct.unpack(">IIBB", body[:10])
            channels = {2: 3, 6: 4}[color]
        elif kind == b"IDAT":
            parts.append(body)
        at += 12 + size
    data, stride, rows, above = zlib.decompress(b"".join(parts)), width * channels, [], bytes(width * channels)
    for y in range(height):
        kind, row = data[y * (stride + 1)], bytearray(data[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride):
            left, up = row[i - channels] if i >= channels else 0, above[i]
            corner = above[i - channels] if i >= channels else 0
            if kind == 4:
                estimate = left + up - corner
                guess = min((left, up, corner), key=lambda value: abs(estimate - value))
            else:
                guess = (0, left, up, (left + up) // 2)[kind]
            row[i] = (row[i] + guess) & 255
        above = bytes(row)
        rows.append(b"".join(above[i : i + 3] for i in range(0, stride, channels)))
    return width, height, rows


class Recorded:
    """Reader of a replay that follows only docs/reference/replay.md."""

    def __init__(self, path):
        page = pathlib.Path(path).read_text()
        self.header = json.loads(re.search(r'id="replay-header">(.*?)</script>', page).group(1))
        data = zlib.decompress(base64.b64decode(re.search(r'id="replay-data">(.*?)</script>', page).group(1)))
        orders, at, self.tracks = {track["name"]: track for track in self.header["tracks"]}, 0, {}
        for section in self.header["sections"]:
            if section["name"] in orders:
                track = orders[section["name"]]
                self.tracks[track["name"]] = self._columns(data[at : at + section["bytes"]], track)
            at += section["bytes"]

    def _columns(self, data, track):
        numbers, bits, shift = [], 0, 0
        for byte in data:
            bits |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                numbers.append(bits >> 1 if bits % 2 == 0 else -(bits >> 1) - 1)
                bits = shift = 0
        frames, columns = self.header["frames"], []
        for begin in range(0, len(numbers), frames):
            value, difference, column = 0, 0, []
            for number in numbers[begin : begin + frames]:
                difference = difference + number if track["order"] == 2 else number
                value = number if track["order"] == 0 else value + difference
                column.append(value * track["unit"])
            columns.append(column)
        return columns


class PageCase(unittest.TestCase):
    BROWSER = "chromium"

    @classmethod
    def setUpClass(cls):
        if shutil.which(cls.BROWSER) is None:
            raise unittest.SkipTest(f"needs {cls.BROWSER}: scripts/setup --browsers installs it")
        cls._folder = tempfile.TemporaryDirectory(prefix="pictura-test-")
        cls.folder = pathlib.Path(cls._folder.name)
        cls.path = cls.folder / "replay.html"
        cls.pictura("replay", "procedural:1:blocks=2x2", "--agents", 24, "--steps", 90, "--policy", "random", "--follow", 4, "--cameras",
                    "--seed", 3, "--out", cls.path)  # fmt: skip
        cls.recorded = Recorded(cls.path)

    @classmethod
    def tearDownClass(cls):
        cls._folder.cleanup()

    @staticmethod
    def pictura(*arguments):
        result = subprocess.run([PICTURA, *map(str, arguments)], capture_output=True, text=True, timeout=600)
        assert result.returncode == 0, result.stderr
        return result


class Chromium(PageCase):
    def setUp(self):
        self.browser = browsers.Chromium()
        self.addCleanup(self.browser.close)

    def open(self, path=None, fragment=""):
        self.browser.open(path or self.path, fragment)
        self.browser.wait_for("window.pictura && !document.getElementById('app').hidden")

    def state(self):
        return self.browser.run("({...pictura.state})")

    def assert_places(self, step):
        drawn = {agent["agent"]: agent for agent in self.browser.run("pictura.drawn()")}
        tracks = self.recorded.tracks
        there = [a for a in range(24) if round(tracks["status"][a][step]) != 3]
        self.assertEqual(sorted(drawn), there)
        for agent in there:
            for name in ("x_m", "y_m", "heading_deg"):
                self.assertAlmostEqual(drawn[agent][name], tracks[name][agent][step], 6, f"agent {agent}, {name}, step {step}")

    def test_it_opens_without_errors_and_draws(self):
        self.open()
        width, height, rows = png_pixels(self.browser.screenshot())
        self.assertEqual((width, height), (1280, 720))
        stage = {rows[y][3 * x : 3 * x + 3] for y in range(60, 580) for x in range(180, 900)}
        self.assertGreater(len(stage), 30)  # colours
        self.assertEqual(self.browser.run("document.getElementById('map-name').textContent"), self.recorded.header["map"])
        self.assertEqual(self.browser.errors, [])

    def test_seeking_shows_the_recorded_places(self):
        self.open()
        halted = next(step for column in self.recorded.tracks["status"] for step, status in enumerate(column) if round(status) == 1)
        for step in (0, 37, halted, 90):
            self.browser.run(f"pictura.actions.seek({step})")
            self.assertEqual(self.state()["time"], step)
            self.assert_places(step)
        # Between two steps of an episode, in the middle.
        x = self.recorded.tracks["x_m"]
        ends = {e["frame"] for e in self.browser.run("pictura.replay.episodes.map(e => ({frame: e.end - 1}))")}
        self.browser.run("pictura.actions.seek(20.5)")
        for agent in self.browser.run("pictura.drawn()"):
            if 20 not in ends:
                a = x[agent["agent"]]
                self.assertAlmostEqual(agent["x_m"], (a[20] + a[21]) / 2, 6)

    def test_agents_are_drawn_at_their_positions(self):
        self.open()
        self.browser.run("pictura.actions.seek(60); pictura.actions.select(23); pictura.state.zoom = 8; void 0")
        agent = next(a for a in range(23) if round(self.recorded.tracks["status"][a][60]) == 0)
        x, y = self.recorded.tracks["x_m"][agent][60], self.recorded.tracks["y_m"][agent][60]
        self.browser.run(f"pictura.state.x = {x}; pictura.state.y = {y}; void 0")
        drawn = next(a for a in self.browser.run("pictura.drawn()") if a["agent"] == agent)
        left, top = self.browser.run("(r => [r.left, r.top])(document.getElementById('world').getBoundingClientRect())")
        shown = [self.browser.run("pictura.drawn() && getComputedStyle(document.documentElement).getPropertyValue('--" + name + "')").strip()
                 for name in ("vehicle", "cyclist", "pedestrian")]  # fmt: skip
        colors = [bytes.fromhex(color[1:]) for color in shown]
        _, _, rows = png_pixels(self.browser.screenshot())
        px, py = round(left + drawn["px"]), round(top + drawn["py"])
        # The pixel at its centre has the class's colour, unless a number or a windscreen covers it.
        near = {rows[py + dy][3 * (px + dx) : 3 * (px + dx) + 3] for dy in range(-2, 3) for dx in range(-2, 3)}
        self.assertTrue(near & set(colors), (near, colors))

    def test_keys_play_step_jump_and_choose(self):
        self.open()
        for key, modifiers, step in [("ArrowRight", 0, 1), ("ArrowRight", 8, 11), ("ArrowLeft", 0, 10), ("End", 0, 90), ("Home", 0, 0)]:
            self.browser.key(key, modifiers)
            self.assertEqual(self.state()["time"], step, key)
        self.browser.key("]")
        self.assertEqual(self.state()["speed"], 2)
        self.browser.key(" ")
        self.assertTrue(self.state()["playing"])
        self.browser.wait_for("pictura.state.time > 3")
        self.browser.key(" ")
        self.assertFalse(self.state()["playing"])
        self.browser.key("Home")
        self.browser.key("n")
        events = [(f, a) for a in range(24) for f, bits in enumerate(self.recorded.tracks["events"][a]) if int(bits) & (1 | 4 | 8 | 16 | 128)]
        first = min(events)
        self.assertEqual((self.state()["time"], self.state()["agent"]), first)
        self.browser.key(".")
        self.assertEqual(self.state()["agent"], (first[1] + 1) % 24)
        self.browser.key("f")
        self.assertTrue(self.state()["follow"])
        self.assertGreaterEqual(self.state()["zoom"], 5)
        self.browser.key("/")
        for letter in "17":
            self.browser.key(letter)
        self.browser.key("Enter")
        self.browser.wait_for("pictura.state.agent === 17")
        self.assertEqual(self.browser.errors, [])

    def test_the_camera_key_cycles_through_cameras_of_any_agent(self):
        self.open(fragment="#step=5&agent=7")
        for camera in [*(camera["name"] for camera in self.recorded.header["cameras"]), ""]:
            self.browser.key("c")
            self.assertEqual((self.state()["agent"], self.state()["camera"]), (7, camera))

    def test_halted_agents_do_not_brake(self):
        tracks = self.recorded.tracks
        halts = [(f, a) for a in range(24) for f in range(1, 91) if round(tracks["status"][a][f]) == 1 and round(tracks["status"][a][f - 1]) == 0]
        frame, agent = max(halts, key=lambda halt: abs(tracks["speed_mps"][halt[1]][halt[0] - 1]))
        self.open(fragment=f"#step={frame}&agent={agent}")
        self.browser.wait_for("document.getElementById('agent-status').textContent.includes('halted')")
        fact = "[...document.querySelectorAll('#facts *')].find(e => e.textContent.startsWith('Acceleration')).textContent"
        self.assertIn("\u2013", self.browser.run(fact))

    def test_absent_agents_have_no_position(self):
        self.open(fragment="#step=20&agent=4&zoom=3&x=5&y=7")
        # Agent 4 enters at step 30.
        self.browser.run(
            "(() => { const { stride, tracks } = pictura.replay;"
            " for (const [name, value] of [['status', 3], ['x_m', 0], ['y_m', 0], ['speed_mps', 0]]) tracks[name].fill(value, 4 * stride, 4 * stride + 30); })()"
        )
        center = lambda: [self.state()["x"], self.state()["y"]]
        self.browser.run("pictura.actions.show(4)")
        self.assertEqual(center(), [5, 7])
        self.browser.run("location.hash = '#step=21&agent=4&zoom=6'")
        self.browser.wait_for("pictura.state.time === 21")
        self.assertEqual(center(), [5, 7])
        # Neither a trail nor an acceleration begins at the origin.
        reached = self.browser.run(
            "(() => { const { prototype } = CanvasRenderingContext2D, { lineTo } = prototype, { width, height } = document.getElementById('world'), points = [];"
            " prototype.lineTo = function (x, y) { points.push([x, y]); lineTo.call(this, x, y); };"
            " pictura.actions.seek(45); pictura.drawn(); prototype.lineTo = lineTo;"
            " const scale = pictura.state.zoom * devicePixelRatio, origin = [width / 2 - 5 * scale, height / 2 + 7 * scale];"
            " return points.some(([x, y]) => Math.hypot(x - origin[0], y - origin[1]) < 1e-6); })()"
        )
        self.assertFalse(reached)
        self.browser.run("pictura.actions.seek(30); pictura.drawn() && null")
        fact = "[...document.querySelectorAll('#facts *')].find(e => e.textContent.startsWith('Acceleration')).textContent"
        self.assertIn("Acceleration0.0", self.browser.run(fact))
        self.assertEqual(self.browser.errors, [])

    def test_clicks_choose_agents_and_events(self):
        self.open()
        self.browser.run("pictura.actions.seek(10)")
        left, top = self.browser.run("(r => [r.left, r.top])(document.getElementById('world').getBoundingClientRect())")
        agents = self.browser.run("pictura.drawn()")
        alone = next(a for a in agents if a["px"] > 220 and a["py"] > 20 and all(b is a or abs(a["px"] - b["px"]) + abs(a["py"] - b["py"]) > 40 for b in agents))
        self.browser.click(left + alone["px"], top + alone["py"])
        self.browser.wait_for(f"pictura.state.agent === {alone['agent']}")
        event = self.browser.run("pictura.replay.events.find(e => e.kind === 1)")
        place = self.browser.run(
            "(r => ({left: r.left, top: r.top, width: r.width}))(document.getElementById('timeline').getBoundingClientRect())")
        x = place["left"] + 78 + event["frame"] / 90 * (place["width"] - 78 - 8)
        self.browser.click(x, place["top"] + 1.5 * 11.5)
        self.browser.wait_for(f"pictura.state.time === {event['frame']}")

    def test_the_time_cursor_hides_no_event(self):
        self.open()
        event = self.browser.run("pictura.replay.events.find(e => e.kind === 1)")
        self.browser.run(f"pictura.actions.goTo({json.dumps(event)}); pictura.drawn() && null")
        place = self.browser.run("(r => ({left: r.left, top: r.top, width: r.width}))(document.getElementById('timeline').getBoundingClientRect())")
        x, y = round(place["left"] + 78 + event["frame"] / 90 * (place["width"] - 78 - 8)), round(place["top"] + 11.5 + 6)
        color = bytes.fromhex(self.browser.run("getComputedStyle(document.documentElement).getPropertyValue('--off-road')").strip()[1:])
        _, _, rows = png_pixels(self.browser.screenshot())
        shown = [rows[y][3 * i : 3 * i + 3] for i in range(x - 2, x + 3)]
        self.assertGreaterEqual(shown.count(color), 4, shown)

    def test_numbers_are_plain_decimals(self):
        self.open(fragment="#agent=4")
        unit = {track["name"]: track["unit"] for track in self.recorded.header["tracks"]}
        step = max(range(91), key=lambda f: sum(0 < abs(self.recorded.tracks[name][4][f]) < 1e-4 for name in unit if name.startswith("reward_")))
        self.browser.run(f"pictura.actions.seek({step}); pictura.drawn() && null")
        cells = self.browser.run("[...document.querySelectorAll('#rewards tr')].map(row => [...row.cells].map(cell => cell.textContent))")
        for term, _, now, _ in cells[:-1]:
            value = self.recorded.tracks["reward_" + term.replace(" ", "_")][4][step]
            self.assertRegex(now, r"^\u2212?\d+(\.\d+)?$", term)
            self.assertAlmostEqual(float(now.replace("\u2212", "-")), value, delta=max(0.0051, 0.01 * abs(value)) if abs(value) >= 1 else 0.006 * abs(value) + 1e-9)

    def test_a_recorded_track_hides_actions_and_rewards(self):
        # An agent with the status of tracks in recordings, which only move.
        self.open(fragment="#step=20&agent=4")
        self.browser.run("pictura.replay.tracks.status.fill(4); pictura.actions.seek(21); pictura.drawn() && null")
        self.assertIn("as recorded", self.browser.run("document.getElementById('agent-status').textContent"))
        self.assertTrue(self.browser.run("document.getElementById('action-section').hidden && document.getElementById('reward-section').hidden"))
        self.assertEqual(self.browser.errors, [])

    def test_the_whole_map_lies_beside_the_legend(self):
        self.open()
        left = self.browser.run("(() => { pictura.drawn(); return document.getElementById('legend').getBoundingClientRect().right; })()")
        shapes = self.browser.run("Math.min(...pictura.replay.map.filter(s => s.kind !== 'light').flatMap(s => [...s.points].filter((_, i) => i % 2 === 0)))")
        state, width = self.state(), self.browser.run("document.getElementById('world').clientWidth")
        self.assertGreaterEqual(width / 2 + (shapes - state["x"]) * state["zoom"], left)

    def test_a_probed_case_is_shown_and_marked(self):
        alive = [a for a in range(24) if round(self.recorded.tracks["status"][a][20]) == 0]
        place = {a: [self.recorded.tracks[name][a][20] for name in ("x_m", "y_m", "heading_deg")] for a in alive}

        def ahead(ego, other):  # in the ego's frame
            (x, y, heading), (u, v, _) = place[ego], place[other]
            c, s = math.cos(math.radians(heading)), math.sin(math.radians(heading))
            return (u - x) * c + (v - y) * s, (v - y) * c - (u - x) * s

        pairs = [(ahead(a, b)[0], a, b) for a in alive for b in alive if ahead(a, b)[0] > 10 and abs(ahead(a, b)[1]) < 0.3 * ahead(a, b)[0]]
        _, ego, removed = min(pairs)
        answer = {"policy": "agent", "value": 1.5, "value_without": 1.25, "brake": 0.02, "brake_without": 0.0213}
        heading = math.radians(place[ego][2])
        x, y = round(100 * place[ego][0] + 600 * math.cos(heading)), round(100 * place[ego][1] + 600 * math.sin(heading))
        box = {"class": 2, "length_cm": 50, "width_cm": 50, "height_cm": 120, "x_cm": x, "y_cm": y, "z_cm": round(100 * self.recorded.tracks["z_m"][ego][20]), "heading_ddeg": 900,
               "path_cm": [[x, y - 500], [x, y + 500]]}  # fmt: skip
        case = {"what": "case 7: somebody is gone", "frame": 20, "ego": ego, "removed": removed, "inserted": None, "answers": [answer]}
        page = self.path.read_text()
        for name, change in {"removed": {}, "inserted": {"removed": None, "inserted": box}}.items():
            with self.subTest(name):
                path = self.folder / "case.html"
                path.write_text(page.replace('"case":null', '"case":' + json.dumps({**case, **change}), 1))
                self.open(path)
                self.assertEqual((self.state()["time"], self.state()["agent"]), (20, ego))
                text = self.browser.run("document.getElementById('case').innerText")
                for part in ("somebody is gone", "+0.25", "\u22120.0013", "1.50"):
                    self.assertIn(part, text)
                color = bytes.fromhex(self.browser.run("getComputedStyle(document.documentElement).getPropertyValue('--case')").strip()[1:])
                count = lambda: sum(row[3 * i : 3 * i + 3] == color for row in png_pixels(self.browser.screenshot())[2][50:590] for i in range(0, 930))
                self.assertGreater(count(), 60)  # the mark's ring
                # Images with the road user and without it.
                change = '{hidden: [%d]}' % removed if name == "removed" else "pictura.replay.caseUser(%d, 20).change" % ego
                changed, as_driven = self.drawn_pictures(ego, 20, change), self.drawn_pictures(ego, 20)
                self.assertTrue(changed != as_driven)
                for is_without in (False, True):
                    self.browser.wait_for(f"pictura.state.isWithout === {json.dumps(is_without)} && document.getElementById('user-shown').textContent.startsWith('{'without' if is_without else 'with '}')")
                    self.browser.run("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame)).then(() => null)")
                    self.assertTrue(self.shown_pictures() == (changed if is_without == (name == "removed") else as_driven))
                    self.browser.key("o")
                self.browser.run("pictura.actions.seek(70); pictura.drawn() && null")
                self.assertTrue(self.browser.run("document.getElementById('user-shown').hidden"))
                self.browser.run("document.getElementById('case-step').click(); pictura.drawn() && null")
                self.assertEqual(self.state()["time"], 20)
                self.assertEqual(self.browser.errors, [])
        self.open()
        self.assertTrue(self.browser.run("document.getElementById('case').hidden"))

    def test_the_address_stores_the_view(self):
        self.open(fragment="#step=42&agent=7&speed=4&zoom=6&follow=1")
        state = self.state()
        self.assertEqual([state[k] for k in ("time", "agent", "speed", "zoom", "follow")], [42, 7, 4, 6, True])
        self.browser.key("ArrowRight")
        self.browser.wait_for("location.hash.includes('step=43')")
        self.browser.call("Page.reload")
        self.browser.wait_for("window.pictura && pictura.state.time === 43 && pictura.state.follow")
        self.browser.run("location.hash = '#step=5&agent=2'")
        self.browser.wait_for("pictura.state.time === 5 && pictura.state.agent === 2")

    def test_the_followed_slot_shows_each_of_its_agents(self):
        lane = '<lane id="%d" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
        street = self.folder / "street.xodr"
        street.write_text(
            '<OpenDRIVE><header revMajor="1" revMinor="4"/><road length="100" id="1" junction="-1"><type s="0" type="town"><speed max="50" unit="km/h"/></type>'
            '<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView><lanes><laneSection s="0">'
            f'<left>{lane % 1}</left><center><lane id="0" type="none"/></center><right>{lane % -1}</right></laneSection></lanes></road></OpenDRIVE>'
        )
        path = self.folder / "street.html"
        self.pictura("replay", street, "--agents", 4, "--steps", 250, "--policy", "lane", "--pedestrians", 0, "--cyclists", 0, "--parked", 0,
                     "--follow", 0, "--cameras", "--out", path)  # fmt: skip
        self.open(path)
        followed = self.browser.run("Array.from({ length: 251 }, (_, frame) => pictura.replay.followedAt(frame))")
        self.assertEqual(followed[0], 0)
        self.assertGreaterEqual(followed[250], 4)
        self.assertTrue(self.browser.run("pictura.replay.hasImages(pictura.replay.followedAt(250), 250) && !pictura.replay.hasImages(0, 250)"))

    def test_images_of_the_followed_agent_equal_those_of_the_file(self):
        self.open(fragment="#step=50&agent=4")
        self.browser.wait_for("pictura.pictured().frame === 50 && pictura.pictured().isKept")
        kept = self.browser.run("pictura.replay.images.frame(50).then(bytes => [...bytes])")
        self.assertEqual(self.shown_pictures(), kept)
        self.assertEqual(len(kept), 4 * 96 * 54 * 3)
        self.assertGreater(sum(value > 0 for value in kept), 1000)

    def shown_pictures(self):
        images = self.browser.run("""[...document.querySelectorAll('.pictures canvas')].map(c => {
            const copy = new OffscreenCanvas(c.width, c.height).getContext('2d', { willReadFrequently: true });
            copy.drawImage(c, 0, 0);
            const d = copy.getImageData(0, 0, c.width, c.height).data;
            return [...d].filter((_, i) => i % 4 < 3);
        })""")
        return [value for image in images for value in image]

    def drawn_pictures(self, agent, frame, change="{}"):
        return self.browser.run(f"[...pictura.drawnImages({agent}, {frame}, {change})]")

    def test_images_drawn_in_the_page_match_the_renderer_within_sampling_error(self):
        self.open()
        squares = count = 0
        for frame in range(0, 91, 10):
            drawn, kept = self.drawn_pictures(4, frame), self.browser.run(f"pictura.replay.images.frame({frame}).then(bytes => [...bytes])")
            self.assertEqual(len(drawn), len(kept))
            self.assertGreater(sum(value > 0 for value in drawn), 1000)
            squares += sum((a - b) ** 2 for a, b in zip(drawn, kept))
            count += len(kept)
        psnr_db = 10 * math.log10(255**2 * count / squares)
        print(f"images drawn in the page: {psnr_db:.1f} dB")
        self.assertGreater(psnr_db, 40)
        self.assertEqual(self.browser.errors, [])

    def test_the_page_draws_images_missing_from_the_file(self):
        # Images of an agent that was not followed, and of the followed agent after the last kept image.
        self.open(fragment="#step=50&agent=7")
        self.browser.wait_for("pictura.pictured().agent === 7")
        self.assertEqual(self.browser.run("pictura.pictured()"), {"frame": 50, "agent": 7, "isKept": False})
        self.assertTrue(self.shown_pictures() == self.drawn_pictures(7, 50))
        note = "document.getElementById('pictures-note').textContent"
        self.assertIn("drawn by this page", self.browser.run(note))
        self.browser.run("pictura.replay.images.frames = 75; pictura.actions.select(4); pictura.actions.seek(74)")
        self.browser.wait_for("pictura.pictured().frame === 74 && pictura.pictured().isKept")
        self.assertEqual(self.browser.run(note), "as recorded")
        self.browser.run("pictura.actions.seek(75)")
        self.browser.wait_for("pictura.pictured().frame === 75 && !pictura.pictured().isKept")
        self.assertTrue(self.shown_pictures() == self.drawn_pictures(4, 75))

    def test_the_page_reports_missing_webgl(self):
        self.open(fragment="#step=50&agent=4")
        self.browser.run("HTMLCanvasElement.prototype.getContext = (of => function (kind, ...more) { return kind === 'webgl2' ? null : of.call(this, kind, ...more); })(HTMLCanvasElement.prototype.getContext)")
        self.browser.run("pictura.actions.select(7)")
        self.browser.wait_for("document.getElementById('pictures-note').textContent.includes('no WebGL2')")
        self.browser.run("pictura.actions.select(4)")
        self.browser.wait_for("document.getElementById('pictures-note').textContent === 'as recorded'")
        self.assertEqual(self.browser.errors, [])

    def test_damaged_data_is_reported(self):
        page = self.path.read_text()
        data = page.index('id="replay-data">') + 17
        images = page.index('id="replay-images">') + 19
        flipped = "B" if page[data + 5000] == "A" else "A"
        damaged = {
            "cut in the numbers": page[: data + 3000],
            "cut before the header": page[: page.index('<script type="application/json"')],
            "a letter of the images": page[: images + 900] + ("B" if page[images + 900] == "A" else "A") + page[images + 901 :],
            "a letter of the numbers": page[: data + 5000] + flipped + page[data + 5001 :],
            "the header": page.replace('{"format"', '{"format', 1),
            "a newer version": page.replace('"version":2,', '"version":9,', 1),
        }
        for name, text in damaged.items():
            with self.subTest(name):
                self.assert_damaged(text, "This replay is damaged")

    def assert_damaged(self, text, message):
        path = self.folder / "damaged.html"
        path.write_text(text)
        self.browser.open(path)
        self.browser.wait_for("document.querySelector('#message.error')")
        self.assertIn(message, self.browser.run("document.getElementById('message').innerText"))
        self.assertTrue(self.browser.run("document.getElementById('app').hidden"))
        self.assertFalse(self.browser.run("document.getElementById('message').hidden"))

    def test_a_damaged_header_is_reported(self):
        page = self.path.read_text()
        at = page.index('id="replay-header">')

        def changed(old, new):  # in the header, not in the script before it
            self.assertIn(old, page[at:])
            return page[:at] + page[at:].replace(old, new, 1)

        for old, new, message in [
            ('"frames":91,', '"frames":90,', "has more numbers than its header declares"),
            ('"frames":91,', '"frames":92,', "its numbers are truncated"),
            ('"frames":91,', '"frames":900000000,', "its numbers are truncated"),
            ('"agents":24,', '"agents":23,', "This replay is damaged"),
            ('"name":"y_m","bytes"', '"name":"why_m","bytes"', "unknown section why_m"),
            ('"followed":4,', '"followed":24,', "followed: expected an agent below 24, got 24"),
            ('"dt_s":', '"dt_s":"0.1","was":', 'dt_s: expected a number, got "0.1"'),
            ('"width_px":', '"width":', "cameras.0.width_px: expected a whole number, got no value"),
        ]:
            with self.subTest(new):
                self.assert_damaged(changed(old, new), message)
        header = self.recorded.header
        for name in ["metrics", "cameras", "lights", "dt_s", "classes", "conditioning", "tracks", "sections", "case", "images", "decision_unit", "light_hues"]:
            with self.subTest(name):
                self.assertIn(name, header)
                self.assert_damaged(changed(f'"{name}":', f'"other_{name}":'), f"its header: {name}: expected")
        for name in header["metrics"]:
            with self.subTest(name):
                self.assert_damaged(changed(f'"{name}":', f'"other_{name}":'), f"its header: metrics.{name}: expected")

    def test_undisplayable_data_is_reported(self):
        # Header with all required members, but with tracks that no view knows.
        page = self.path.read_text()
        at = page.index('id="replay-header">')
        self.assert_damaged(page[:at] + page[at:].replace('"name":"steer_deg"', '"name":"steering"'), "This replay is damaged: a part of it cannot be shown")
        self.assertTrue(self.browser.errors)

    def test_the_gallery_filters_and_links_to_replays(self):
        folder = self.folder / "gallery"
        self.pictura("replay", "procedural:1:blocks=2x2", "--agents", 8, "--steps", 40, "--policy", "random", "--gallery", folder, "--episodes", 3)
        self.pictura("replay", "procedural:1:blocks=2x2", "--agents", 2, "--steps", 3, "--policy", "idle", "--out", folder / "still.html")
        self.pictura("replay", "procedural:1:blocks=2x2", "--agents", 8, "--steps", 40, "--policy", "random", "--gallery", folder, "--episodes", 3)
        self.browser.open(folder / "index.html")
        cards = "[...document.querySelectorAll('#list a')].map(a => a.getAttribute('href'))"
        self.assertEqual(len(self.browser.run(cards)), 4)
        self.assertIn("still.html", self.browser.run(cards)[-1])
        self.browser.run("[...document.querySelectorAll('#filters button')].find(b => b.textContent === 'Off road').click()")
        filtered = self.browser.run(cards)
        self.assertEqual(len(filtered), 3)
        boxes = self.browser.run("[...document.querySelector('#list a').children].map(e => (r => [r.left, r.right])(e.getBoundingClientRect()))")
        for (_, right), (left, _) in zip(boxes, boxes[1:]):
            self.assertLessEqual(right, left)
        name, _, fragment = filtered[0].partition("#")
        self.open(folder / name, "#" + fragment)
        self.assertRegex(fragment, r"step=\d+&agent=\d+")
        self.assertEqual(self.state()["agent"], int(re.search(r"agent=(\d+)", fragment).group(1)))
        self.assertEqual(self.browser.errors, [])


class Firefox(PageCase):
    BROWSER = "firefox-esr"

    def test_it_opens_draws_and_shows_the_recorded_places(self):
        browser = browsers.Firefox()
        self.addCleanup(browser.close)
        browser.open(self.path)
        browser.wait_for("!!window.pictura && !document.getElementById('app').hidden")
        drawn = browser.run("pictura.actions.seek(37); JSON.stringify(pictura.drawn())")
        for agent in json.loads(drawn):
            self.assertAlmostEqual(agent["x_m"], self.recorded.tracks["x_m"][agent["agent"]][37], 6)
        # Not every Firefox has WebGL2: a headless one without a display has none.
        note = "document.getElementById('pictures-note').textContent"
        browser.run("pictura.actions.select(4)")
        browser.wait_for(f"{note} === 'as recorded'")
        browser.run("pictura.actions.select(7)")
        browser.wait_for(f"{note}.includes('drawn')")
        if browser.run(f"{note}.includes('no WebGL2')"):
            self.assertTrue(browser.run("document.querySelector('.pictures').hidden"))
        _, _, rows = png_pixels(browser.screenshot())
        self.assertGreater(len({row[3 * x : 3 * x + 3] for row in rows for x in range(0, len(row) // 3)}), 30)


if __name__ == "__main__":
    PICTURA = sys.argv.pop(1)
    unittest.main()
