"""The search of the documentation's site works on pages that are opened from disk. Needs chromium.

Usage: python3 site_search_test.py. Also tests the built site, build/docs/site, if it exists.
"""

import json
import pathlib
import shutil
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/replay"))
import browsers  # noqa: E402

SITE = ROOT / "build/docs/site"


class Search(unittest.TestCase):
    def setUp(self):
        if shutil.which("chromium") is None:
            self.skipTest("needs chromium: scripts/setup --browsers installs it")
        self.browser = browsers.Chromium()
        self.addCleanup(self.browser.close)

    def test_a_worker_runs_on_a_page_from_disk(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            shutil.copy(ROOT / "docs/iframe-worker.js", folder)
            (folder / "double.js").write_text("addEventListener('message', (event) => postMessage(2 * event.data))")
            (folder / "page.html").write_text("""<body><script src="iframe-worker.js"></script><script>
                const got = [], worker = new Worker("double.js");
                worker.addEventListener("message", (event) => got.push(event.data));
                worker.postMessage(1);  // before the frame has loaded
                worker.postMessage(2);
            </script></body>""")
            self.browser.open(folder / "page.html")
            self.browser.wait_for("got.length === 2", timeout_s=20)
            self.assertEqual(self.browser.run("got"), [2, 4])
        self.assertEqual(self.browser.errors, [])

    def test_the_built_site_finds_a_word(self):
        if not (SITE / "iframe-worker.js").exists():
            self.skipTest("needs the site: scripts/docs builds it")
        self.browser.open(SITE / "how-to/train.html")
        for word, answer in (("jerk", r"^\s*\d+ matching documents"), ("zzzqqq", "No matching documents")):
            self.browser.run(f"""(() => {{
                const toggle = document.querySelector('[data-md-toggle=search]'), query = document.querySelector('[data-md-component=search-query]');
                if (!toggle.checked) toggle.click();
                query.value = {json.dumps(word)};
                query.dispatchEvent(new Event('keyup', {{bubbles: true}}));
            }})()""")
            self.browser.wait_for(f"/{answer}/.test(document.querySelector('.md-search-result__meta').textContent)", timeout_s=20)
        self.assertEqual(self.browser.errors, [])


if __name__ == "__main__":
    unittest.main()
