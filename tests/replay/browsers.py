"""Headless browsers for tests, through their own protocols, with only the standard library.

Chromium uses the DevTools protocol over a pair of pipes, Firefox Marionette over a socket.
"""

import base64
import json
import os
import pathlib
import select
import shutil
import socket
import subprocess
import tempfile
import time


class Browser:
    """Runs expressions in a page."""

    def wait_for(self, expression, timeout_s=60):
        end = time.monotonic() + timeout_s
        while not self.run(f"!!({expression})"):
            if time.monotonic() > end:
                raise TimeoutError(f"never became true: {expression}")
            time.sleep(0.05)


class Chromium(Browser):
    """One page. `errors` collects its logged errors and exceptions."""

    def __init__(self, width=1280, height=720, scheme="dark", touch=False):
        self.profile = tempfile.TemporaryDirectory(prefix="pictura-chromium-", ignore_cleanup_errors=True)
        to_browser, self.to_browser = os.pipe()
        self.from_browser, from_browser = os.pipe()
        # The protocol's descriptors are 3 and 4.
        script = f'exec 3<&{to_browser} 4>&{from_browser}; exec "$@"'
        command = [
            "bash", "-c", script, "bash", shutil.which("chromium"), "--headless=new", "--no-sandbox", "--remote-debugging-pipe",
            f"--user-data-dir={self.profile.name}", f"--window-size={width},{height}", "--use-gl=angle", "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
            "--disable-component-update", "--hide-scrollbars", "about:blank",
        ]  # fmt: skip
        self.process = subprocess.Popen(command, pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.buffer, self.count, self.errors = b"", 0, []
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def _message(self, timeout_s):
        while b"\0" not in self.buffer:
            if not select.select([self.from_browser], [], [], timeout_s)[0]:
                raise TimeoutError("chromium does not answer")
            more = os.read(self.from_browser, 1 << 20)
            if not more:
                raise ConnectionError("chromium has ended")
            self.buffer += more
        text, self.buffer = self.buffer.split(b"\0", 1)
        message = json.loads(text)
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(" ".join(str(a.get("value", a.get("description"))) for a in params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.errors.append(params["entry"]["text"])
        return message

    def call(self, method, timeout_s=120, **params):
        self.count += 1
        message = {"id": self.count, "method": method, "params": params}
        if getattr(self, "session", None):
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message(timeout_s)
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def open(self, path, fragment=""):
        self.open_address(pathlib.Path(path).resolve().as_uri() + fragment)

    def open_address(self, address):
        # Loads a new document each time, even if only the fragment differs.
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=address)
        self.wait_for("document.readyState === 'complete'")

    def run(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description", "failed"))
        return result["result"].get("value")

    def key(self, key, modifiers=0):
        text = "\r" if key == "Enter" else key if len(key) == 1 else ""
        code = {"ArrowRight": 39, "ArrowLeft": 37, "Home": 36, "End": 35, "Enter": 13}.get(key, ord(key[0].upper()))
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, text=text if kind == "keyDown" else "", modifiers=modifiers,
                      windowsVirtualKeyCode=code)  # fmt: skip

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def click(self, x, y):
        self.mouse("mouseMoved", x, y)
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y, button="left", clickCount=1, buttons=1 if kind == "mousePressed" else 0)

    def screenshot(self):
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def close(self):
        try:
            self.call("Browser.close", timeout_s=10)
        except (OSError, RuntimeError):
            pass
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.to_browser)
        os.close(self.from_browser)
        self.profile.cleanup()


class Firefox(Browser):
    """One page, by Marionette."""

    def __init__(self, width=1280, height=720):
        self.profile = tempfile.TemporaryDirectory(prefix="pictura-firefox-", ignore_cleanup_errors=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        (pathlib.Path(self.profile.name) / "user.js").write_text(f'user_pref("marionette.port", {port});\n')
        environment = {**os.environ, "HOME": self.profile.name, "MOZ_HEADLESS": "1"}
        self.process = subprocess.Popen(
            [shutil.which("firefox-esr"), "--headless", "--marionette", "--remote-allow-system-access", "--no-remote",
             "--profile", self.profile.name, "--width", str(width), "--height", str(height)],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)  # fmt: skip
        self.socket, self.buffer, self.count = self._connect(port), b"", 0
        self._read()  # reads its greeting
        self.call("WebDriver:NewSession", {"capabilities": {"alwaysMatch": {"acceptInsecureCerts": True}}})
        self.call("WebDriver:SetWindowRect", {"width": width, "height": height})

    def _connect(self, port, timeout_s=120):
        end = time.monotonic() + timeout_s
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=120)
            except OSError:
                if time.monotonic() > end or self.process.poll() is not None:
                    raise
                time.sleep(0.2)

    def _read(self):
        while b":" not in self.buffer:
            self.buffer += self.socket.recv(1 << 16)
        size, rest = self.buffer.split(b":", 1)
        while len(rest) < int(size):
            rest += self.socket.recv(1 << 20)
        self.buffer = rest[int(size) :]
        return json.loads(rest[: int(size)])

    def call(self, method, params):
        self.count += 1
        text = json.dumps([0, self.count, method, params])
        self.socket.sendall(f"{len(text)}:{text}".encode())
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(f"{method}: {error['message']}")
        return result

    def open(self, path):
        self.call("WebDriver:Navigate", {"url": pathlib.Path(path).resolve().as_uri()})

    def run(self, expression):
        # Runs in the page's own JavaScript world, not in a world that only shares its document.
        return self.call("WebDriver:ExecuteScript", {"script": f"return window.wrappedJSObject ? window.wrappedJSObject.eval({json.dumps(expression)}) : eval({json.dumps(expression)})",
                                                     "args": [], "sandbox": None})["value"]  # fmt: skip

    def screenshot(self):
        return base64.b64decode(self.call("WebDriver:TakeScreenshot", {"full": False})["value"])

    def close(self):
        try:
            self.call("Marionette:Quit", {"flags": ["eForceQuit"]})
        except (OSError, RuntimeError, ValueError):
            pass
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.socket.close()
        self.profile.cleanup()
