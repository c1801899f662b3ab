"""`pictura simulate --serve`: accepted requests, sent messages, that a page which does not read delays nothing, and a
page in Chromium that drives an agent.

Run by ctest, one entry per class: python3 live_test.py PICTURA [unittest arguments].
"""

import contextlib
import gzip
import http.client
import json
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest
import urllib.parse

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1] / "support")]
import browsers
from replay_pages import Events

PICTURA = ""
WORLD = ["procedural:1:blocks=2x2", "--agents", "12", "--policy", "lane", "--seed", "3"]


class Served(unittest.TestCase):
    """Each test has its own simulation."""

    def serve(self, *arguments):
        self.process = subprocess.Popen([PICTURA, "simulate", *WORLD, "--serve", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.stop)
        line = self.process.stderr.readline()
        self.opens_with = line.split()[1].partition("#")[2]
        self.address = re.search(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/", line).group()
        parts = urllib.parse.urlsplit(self.address)
        self.port, self.path = parts.port, parts.path

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            self.process.communicate(timeout=60)
        finally:
            if self.process.poll() is None:
                self.process.kill()
                self.process.communicate()

    def ask(self, method="GET", path=None, body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(method, self.path if path is None else path, body, headers)
        response = connection.getresponse()
        text = response.read().decode()
        connection.close()
        return response, text

    def control(self, request, **headers):
        body = request if isinstance(request, str) else json.dumps(request)
        return self.ask("POST", self.path + "control", body, **{"Content_Type": "application/json", **headers})


class Http(Served):
    def test_requests_without_the_token_are_refused(self):
        self.serve()
        response, text = self.ask()
        self.assertEqual(response.status, 200)
        self.assertIn('id="replay-live"', text)
        self.assertIn("default-src 'none'", response.headers["Content-Security-Policy"])
        token = self.path.strip("/")
        wrong = ("0" if token[0] != "0" else "1") + token[1:]
        for path in ("/", "/events", f"/{wrong}/", f"/{wrong}/events", f"/{token[:-1]}/", f"/x{token}/"):
            with self.subTest(path):
                self.assertEqual(self.ask(path=path)[0].status, 404)
        self.assertEqual(self.ask("POST", f"/{wrong}/control", "{}", Content_Type="application/json")[0].status, 404)

    def test_other_hosts_and_origins_are_refused(self):
        self.serve()
        own = f"http://127.0.0.1:{self.port}"
        for headers, status in [
            ({"Host": f"localhost:{self.port}"}, 200),
            ({"Host": f"attacker.example:{self.port}"}, 403),
            ({"Host": "127.0.0.1"}, 403),
            ({"Host": f"127.0.0.1:{self.port}", "Origin": own}, 200),
            ({"Origin": "http://attacker.example"}, 403),
            ({"Origin": "null"}, 403),
            ({"Origin": f"http://localhost:{self.port}"}, 403),
            ({"Sec_Fetch_Site": "cross-site"}, 403),
            ({"Sec_Fetch_Site": "same-site"}, 403),
            ({"Sec_Fetch_Site": "none"}, 200),
        ]:
            with self.subTest(headers):
                self.assertEqual(self.ask(**headers)[0].status, status)
        self.assertEqual(self.control({"paused": True}, Origin="http://attacker.example")[0].status, 403)
        self.assertEqual(self.control({"paused": True}, Content_Type="text/plain")[0].status, 415)
        self.assertEqual(self.control({"paused": True}, Origin=own)[0].status, 204)

    def test_it_listens_only_on_the_loopback_interface(self):
        self.serve()
        sockets = pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]
        listening = [line.split()[1] for line in sockets if line.split()[3] == "0A"]
        self.assertEqual([a for a in listening if int(a.split(":")[1], 16) == self.port], [f"0100007F:{self.port:04X}"])

    def test_errors_name_wrong_requests(self):
        self.serve()
        for request, message in [
            ("{", "expected JSON"),
            ([1], "expected an object of JSON, got array"),
            ({"paused": 1}, "paused: expected true or false, got 1"),
            ({"steps": 0}, "steps: expected a number of 1 to 1000, got 0"),
            ({"steps": 1.5}, "steps: expected a number of 1 to 1000, got 1.5"),
            ({"pace": 1e9}, "pace: expected a number of 0.05 to 64, got 1000000000.0"),
            ({"watch": 12}, "watch: expected a number of 0 to 11, got 12"),
            ({"drive": -2}, "drive: expected a number of -1 to 11, got -2"),
            ({"keys": ["up"]}, 'keys: expected forward, backward, stop, left or right, got "up"'),
            ({"quit": 1}, 'expected paused, steps, pace, watch, drive or keys, got "quit"'),
        ]:
            with self.subTest(message):
                response, text = self.control(request)
                self.assertEqual((response.status, text), (400, message + "\n"))
        self.assertEqual(self.control({"keys": ["left"] * 3000})[0].status, 413)

    def test_it_starts_with_the_first_page_pauses_and_steps(self):
        self.serve("--cameras")
        events = Events(self.address)
        self.assertEqual(events.type, "text/event-stream")
        begin = events.next("begin")
        self.assertEqual(begin["step"], 0)
        self.assertEqual((begin["header"]["agents"], begin["header"]["frames"]), (12, 1))
        self.assertEqual(events.next("look")["agent"], 0)
        self.assertEqual([events.next("frame")["step"] for _ in range(3)], [1, 2, 3])
        self.control({"paused": True})
        while not events.next("status")["paused"]:
            pass
        self.control({"steps": 2, "watch": 5})
        looks = [events.next("look") for _ in range(3)]
        self.assertEqual([look["agent"] for look in looks], [5, 5, 5])
        self.assertEqual(looks[2]["step"], looks[0]["step"] + 2)
        self.assertEqual(len(looks[2]["images"]), 4 * (4 * 96 * 54 * 3) // 3)
        time.sleep(0.5)
        late = Events(self.address)
        self.assertEqual(late.next("begin")["step"], looks[2]["step"])
        self.assertTrue(late.next("status")["paused"])
        # A pause ends the requested steps.
        self.control({"steps": 1000})
        self.control({"paused": True})
        at = []
        for _ in range(2):
            time.sleep(0.3)
            watching = Events(self.address)
            at.append(watching.next("begin")["step"])
            watching.close()
        self.assertEqual(at[0], at[1])
        self.assertLess(at[1], looks[2]["step"] + 1000)
        events.close()
        late.close()

    def test_keys_drive_one_agent_until_released(self):
        self.serve()
        events = Events(self.address)
        tracks = [track["name"] for track in events.next("begin")["header"]["tracks"]]
        actions, speed = tracks.index("action"), tracks.index("speed_mps")
        driven = 7
        self.control({"drive": driven, "keys": ["forward", "left"], "watch": driven})
        while events.next("status")["driven"] != driven:
            pass
        first = events.next("frame")["tracks"]
        # 4 m/s3 along and to the left, until that acceleration is reached: action 11, as 1 + 11.
        self.assertEqual(first[actions][driven], 12)
        frames = []
        for _ in range(8):
            self.control({"keys": ["forward"]})
            frames.append(events.next("frame")["tracks"])
        self.assertGreater(frames[-1][speed][driven], first[speed][driven])
        # A page that has gone leaves the agent to the policy.
        begin = time.monotonic()
        while events.next("status")["driven"] != -1:
            pass
        self.assertLess(time.monotonic() - begin, 30)
        events.close()

    def test_an_unresponsive_page_does_not_block_others(self):
        self.serve("--cameras")
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", self.port))
        slow.sendall(f"GET {self.path}events HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
        quick = Events(self.address)
        quick.next("begin")
        self.control({"pace": 64})
        # More frames than may wait for the slow page, in messages and in the system's buffers.
        begin, first = time.monotonic(), quick.next("frame")["step"]
        steps = [quick.next("frame")["step"] for _ in range(200)]
        self.assertEqual(steps, list(range(first + 1, first + 201)))
        self.assertLess(time.monotonic() - begin, 60)
        slow.close()
        quick.close()

    def test_the_number_of_pages_is_limited_by_threads(self):
        self.serve()
        pages = [Events(self.address) for _ in range(8)]
        self.assertEqual(self.ask(path=self.path + "events")[0].status, 503)
        self.assertEqual(self.ask()[0].status, 200)
        for page in pages:
            page.close()

    def test_a_port_of_another_pictura_server_is_an_error(self):
        self.serve()
        # The command would wait for its first page: the timeout ends it if it does listen.
        result = subprocess.run([PICTURA, "simulate", *WORLD, "--serve", str(self.port)], capture_output=True, text=True, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (1, f"error: serve: cannot listen on 127.0.0.1:{self.port}: is the port in use?\n"))
        self.assertEqual(self.ask()[0].status, 200)

    def test_it_ends_after_its_steps_and_reports(self):
        self.serve("--steps", "20", "--json", "--follow", "3")
        self.assertEqual(self.opens_with, "agent=3")
        events = Events(self.address)
        self.control({"pace": 64})
        self.assertEqual(events.next("end")["step"], 20)
        out, _ = self.process.communicate(timeout=60)
        self.assertEqual((self.process.returncode, json.loads(out)["steps"]), (0, 20))


class Limits(Served):
    """Limits on the cost of a connection from any client."""

    def raw(self, text):
        """Opens a connection and sends text."""
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=30)
        self.addCleanup(connection.close)
        connection.sendall(text if isinstance(text, bytes) else text.encode())
        return connection

    def status(self, text):
        answer = self.raw(text).recv(4096)
        return int(answer.split()[1]) if answer else None

    def head(self, method, name, *fields):
        return "\r\n".join([f"{method} {self.path}{name} HTTP/1.1", f"Host: 127.0.0.1:{self.port}", *fields, "", ""])

    def test_requests_beyond_limits_are_refused(self):
        self.serve()
        json_type = "Content-Type: application/json"
        nested = gzip.compress(b"[" * 1000000)
        for status, request in [
            # 1 MB after decompression, which overflowed the stack.
            (415, self.head("POST", "control", json_type, "Content-Encoding: gzip", f"Content-Length: {len(nested)}").encode() + nested),
            (501, self.head("POST", "control", json_type, "Transfer-Encoding: chunked") + "ffffffff\r\n"),
            (413, self.head("POST", "control", json_type, "Content-Length: 18446744073709551615")),
            (400, self.head("POST", "control", json_type, "Content-Length: -1")),
            (400, self.head("POST", "control", json_type, "Content-Length: 2", "Content-Length: 3") + "{}"),
            (400, self.head("POST", "control", json_type, "Content-Length: 40") + "[" * 40),
            (400, self.head("GET", "", "a line without a name")),
            (400, "GET / HTTP/2\r\n\r\n"),
            (400, "\0\xff" * 100 + "\r\n\r\n"),
            (405, self.head("DELETE", "")),
            (431, self.head("GET", "", *["X: y"] * 20000)),
            (431, self.head("GET", "", "X: " + "y" * 20000)),
            # Range requests are answered in full.
            (200, self.head("GET", "", "Range: bytes=" + ",".join(["0-"] * 1000))),
        ]:
            with self.subTest(request[:200]):
                self.assertEqual(self.status(request), status)
        self.assertIsNone(self.process.poll())

    def test_a_request_times_out_after_five_seconds(self):
        self.serve()
        slow = self.raw(self.head("GET", "")[:-2])
        begin = time.monotonic()
        with contextlib.suppress(ConnectionError):
            while time.monotonic() - begin < 20:
                slow.sendall(b"X: y\r\n")
                slow.settimeout(0.2)
                with contextlib.suppress(TimeoutError):
                    if slow.recv(1) == b"":
                        break
        self.assertGreater(time.monotonic() - begin, 3)
        self.assertLess(time.monotonic() - begin, 10)

    def test_connections_do_not_delay_the_end(self):
        self.serve("--cameras")
        idle = [self.raw("") for _ in range(4)]
        halfway = [self.raw(self.head("POST", "control", "Content-Length: 100")) for _ in range(4)]
        deaf = self.raw(self.head("GET", "events"))
        events = Events(self.address)
        events.next("frame")
        time.sleep(0.5)
        begin = time.monotonic()
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)
        self.assertLess(time.monotonic() - begin, 1 + 2)  # other work of the command
        for connection in [*idle, *halfway, deaf]:
            connection.close()
        events.close()


class Usage(unittest.TestCase):
    def test_invalid_options_are_refused(self):
        for arguments, message in [
            (["--serve", "99999"], "--serve: expected a port of 1 to 65535, got '99999'"),
            (["--serve-host", "here"], "--serve-host: has no effect without --serve"),
        ]:
            result = subprocess.run([PICTURA, "simulate", *WORLD, *arguments], capture_output=True, text=True, timeout=60)
            self.assertEqual((result.returncode, result.stderr), (2, f"error: {message}\n"))

    def test_a_port_in_use_is_an_error(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            result = subprocess.run([PICTURA, "simulate", *WORLD, "--serve", str(port)], capture_output=True, text=True, timeout=60)
        self.assertEqual((result.returncode, result.stderr), (1, f"error: serve: cannot listen on 127.0.0.1:{port}: is the port in use?\n"))


class Chromium(Served):
    @classmethod
    def setUpClass(cls):
        if shutil.which("chromium") is None:
            raise unittest.SkipTest("needs chromium: scripts/setup --browsers installs it")

    def setUp(self):
        self.serve("--cameras")
        self.browser = browsers.Chromium()
        self.addCleanup(self.browser.close)
        self.browser.open_address(self.address)
        self.browser.wait_for("window.pictura && !document.getElementById('app').hidden && pictura.replay.frames > 3")

    def hold(self, key, is_down):
        self.browser.call("Input.dispatchKeyEvent", type="keyDown" if is_down else "keyUp", key=key)

    def test_it_follows_the_newest_step_pauses_and_steps(self):
        frames = self.browser.run("pictura.replay.frames")
        self.browser.wait_for(f"pictura.state.time > {frames}")
        self.browser.key(" ")
        self.browser.wait_for("pictura.live.paused && pictura.state.time === pictura.replay.frames - 1")
        paused = self.browser.run("pictura.replay.frames")
        time.sleep(0.5)
        self.assertEqual(self.browser.run("pictura.replay.frames"), paused)
        self.browser.key("ArrowRight")
        self.browser.wait_for(f"pictura.replay.frames === {paused + 1} && pictura.state.time === {paused}")
        # The page goes back in its recorded frames while the world is paused.
        self.browser.key("Home")
        self.assertEqual(self.browser.run("[pictura.state.time, pictura.state.isAtEdge]"), [0, False])
        self.browser.key(" ")
        self.browser.wait_for("pictura.state.isAtEdge && !pictura.live.paused")
        self.assertEqual(self.browser.errors, [])

    def test_another_agent_is_watched_with_its_images(self):
        self.browser.run("pictura.actions.select(8)")
        self.browser.wait_for("pictura.replay.isFollowed(8, pictura.replay.frames - 1) && pictura.pictured().frame > 0 && pictura.pictured().isKept")
        self.browser.wait_for("!document.getElementById('cameras').hidden")
        shown = self.browser.run("[...document.querySelectorAll('.pictures canvas')].map(c => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v, i) => i % 4 < 3 && v > 0))")
        self.assertEqual(len(shown), 4)
        self.assertIn(True, shown)

    def test_a_person_drives(self):
        active = "[...Array(12).keys()].filter(a => pictura.replay.raw('status', a, pictura.replay.frames - 1) === 0 && pictura.replay.body(a, pictura.replay.frames - 1).agentClass === 0)"
        # Other agents may hit an agent that stops in their way; then another agent is driven.
        tried = []
        while len(tried) < 10:
            self.browser.wait_for(f"{active}.length > 0")
            tried.append(min(self.browser.run(active) or [0], key=tried.count))
            actions = self.drive(tried[-1])
            if actions is not None:
                break
        else:
            self.fail(f"agents {tried} were halted while they were driven")
        self.assertIn(3, [action // 3 for action in actions])  # 4 m/s3 along; the wheels may still be turning straight
        self.assertEqual(self.browser.errors, [])

    def drive(self, agent):
        """Takes control of an agent, stops it, drives it and releases it. Returns its actions since it stood, or None if it was
        halted."""
        last = "pictura.replay.frames - 1"
        self.browser.run(f"pictura.actions.select({agent})")
        self.browser.key("t")
        self.browser.wait_for(f"pictura.live.driven === {agent} && document.getElementById('drive').getAttribute('aria-pressed') === 'true'")

        def hold(key, until):  # until the condition, or until it is halted; returns whether it is not halted
            self.hold(key, True)
            # Stored in the page, since another episode may begin between two looks.
            self.browser.run("window.wasHalted = false")
            self.browser.wait_for(f"(window.wasHalted ||= pictura.replay.raw('status', {agent}, {last}) !== 0) || {until}")
            self.hold(key, False)
            return not self.browser.run("window.wasHalted")

        # Stops first, so that any motion comes from the keys.
        actions = None
        if hold(" ", f"Math.abs(pictura.replay.get('speed_mps', {agent}, {last})) < 0.2"):
            at = self.browser.run(last)
            if hold("w", f"pictura.replay.get('speed_mps', {agent}, {last}) > 1.5"):
                actions = self.browser.run(f"pictura.replay.tracks.action.slice({agent} * pictura.replay.stride + {at}, {agent} * pictura.replay.stride + pictura.replay.frames).reduce((all, a) => [...all, a - 1], [])")
        self.browser.key("t")
        self.browser.wait_for("pictura.live.driven === -1 && pictura.live.mine === -1")
        return actions

    def test_images_continue_after_the_page_fell_behind(self):
        # As after lost messages: the page restarts with the newest step, then discards its oldest steps.
        self.control({"paused": True})
        self.browser.wait_for("pictura.live.paused")
        self.browser.run("""new Promise(resolve => {
            const source = new EventSource('events');
            source.addEventListener('begin', event => { source.close(); resolve(JSON.parse(event.data)); });
        }).then(begin => pictura.replay.constructor.of(begin)).then(begun => { pictura.replay.restart(begun); pictura.live.on.restart(); return null; })""")
        self.assertEqual(self.browser.run("pictura.replay.frames"), 1)
        self.control({"steps": 5})
        self.browser.wait_for("pictura.replay.frames === 6 && pictura.replay.looks.has(5)")
        self.browser.run("pictura.replay.drop(2); pictura.live.on.frame(2)")
        self.control({"steps": 3})
        self.browser.wait_for("pictura.replay.frames === 7 && pictura.replay.looks.has(6)")
        self.assertEqual(self.browser.run("pictura.replay.imagesOf(6).then(bytes => bytes?.length)"), 4 * 96 * 54 * 3)
        self.browser.run("pictura.actions.seek(6)")
        self.browser.wait_for("pictura.pictured().frame === 6 && pictura.pictured().isKept")
        self.assertEqual(self.browser.errors, [])

    def test_a_halt_shows_its_world_time(self):
        # A page that connected after the world's start.
        self.browser.wait_for("pictura.replay.frames > 5")
        self.control({"paused": True})
        self.browser.wait_for("pictura.live.paused")
        self.browser.run("(r => { r.firstStep = 600; for (const f of [3, 4, 5]) r.tracks.status[f] = 1; ++r.version; })(pictura.replay); pictura.actions.select(0); pictura.actions.seek(5); pictura.drawn() && null")
        self.assertIn("halted since 60.3 s", self.browser.run("document.getElementById('agent-status').textContent"))
        self.assertIn("60.5 s, step 605", self.browser.run("document.getElementById('clock').textContent"))

    def fill_up(self):
        """Takes all slots for pages, once other pages have freed theirs."""
        pages, end = [], time.monotonic() + 60
        while len(pages) < 8:
            try:
                pages.append(Events(self.address))
                self.addCleanup(pages[-1].close)
            except AssertionError:
                self.assertLess(time.monotonic(), end)
                time.sleep(0.2)
        # Nothing is sent to a page that does not read.
        self.control({"paused": True})
        return pages

    def test_the_ninth_page_shows_that_the_limit_is_reached(self):
        self.browser.call("Page.navigate", url="about:blank")
        pages = self.fill_up()
        self.browser.open_address(self.address)
        self.browser.wait_for("document.querySelector('#message.error')")
        message = self.browser.run("document.getElementById('message').innerText")
        self.assertEqual(message.strip(), "This page cannot show the simulation: 8 pages are already connected, or the simulation has ended.")
        self.assertTrue(self.browser.run("document.getElementById('app').hidden"))
        # A slot is free once another page has gone.
        pages[0].close()
        self.control({"paused": False})
        end = time.monotonic() + 60
        while self.browser.run("document.getElementById('app').hidden"):
            self.assertLess(time.monotonic(), end)
            self.browser.open_address(self.address)
            self.browser.wait_for("window.pictura")

    def test_an_unreadable_begin_message_is_reported(self):
        self.browser.call("Page.addScriptToEvaluateOnNewDocument", source="""window.EventSource = class extends EventTarget {
            constructor() { super(); setTimeout(() => this.dispatchEvent(new MessageEvent('begin', { data: '{' })), 50); }
            close() { window.isClosed = true; }
        }""")
        self.browser.open_address(self.address)
        self.browser.wait_for("document.querySelector('#message.error')")
        self.assertIn("This page cannot show the simulation: a part of it", self.browser.run("document.getElementById('message').innerText"))
        self.assertTrue(self.browser.run("window.isClosed && document.getElementById('app').hidden"))

    def test_the_page_shows_the_end_of_the_simulation(self):
        self.stop()
        self.browser.wait_for("document.getElementById('live-state').textContent === 'the simulation has ended'")
        self.browser.key("Home")
        self.assertEqual(self.browser.run("pictura.state.time"), 0)
        self.assertEqual(self.browser.errors, [])


if __name__ == "__main__":
    PICTURA = sys.argv.pop(1)
    unittest.main()
