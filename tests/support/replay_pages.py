"""Readers of replays and live pages for tests."""

import http.client
import json
import re
import urllib.parse


def header_of(path):
    """Returns the header of a replay page, a dict."""
    return json.loads(re.search(r'id="replay-header">(.*?)</script>', path.read_text()).group(1))


class Events:
    """Reader of the events of a live page."""

    def __init__(self, address):
        parts = urllib.parse.urlsplit(address)
        self.connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=60)
        self.connection.request("GET", parts.path + "events")
        self.response = self.connection.getresponse()
        assert self.response.status == 200, self.response.status
        self.type = self.response.headers["Content-Type"]

    def next(self, *names):
        """Waits for the next event with one of these names, and returns its data."""
        name = None
        while True:
            line = self.response.readline().decode().rstrip("\n")
            if line.startswith("event: "):
                name = line[7:]
            elif line.startswith("data: ") and name in names:
                return json.loads(line[6:])
            elif line == "" and self.response.closed:
                raise EOFError("the events have ended")

    def close(self):
        self.connection.close()
        self.response.close()
