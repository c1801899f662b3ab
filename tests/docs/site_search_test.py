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
# Queries of users, and the page that the search lists first.
FIRST_PAGES = {
    "--decision-steps": "reference/commands/evaluate",
    "--camera-severity": "reference/commands/evaluate",
    "minibatch_size": "reference/configuration",
    "red light": "explanation/simulator",
    "argmax": "reference/python/training",
    "fault": "explanation/evaluation",
    "out of memory": "how-to/troubleshoot",
}


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
            self.search(word)
            self.browser.wait_for(f"/{answer}/.test(document.querySelector('.md-search-result__meta').textContent)", timeout_s=20)
        self.assertEqual(self.browser.errors, [])

    def test_the_built_site_finds_the_page_that_answers(self):
        if not (SITE / "iframe-worker.js").exists():
            self.skipTest("needs the site: scripts/docs builds it")
        self.browser.open(SITE / "how-to/train.html")
        first = "document.querySelector('.md-search-result__item > .md-search-result__link')?.href ?? ''"
        for query, page in FIRST_PAGES.items():
            with self.subTest(query=query):
                self.search("zzzqqq")
                self.browser.wait_for(f"({first}) === ''", timeout_s=20)
                self.search(query)
                self.browser.wait_for(f"({first}) !== ''", timeout_s=20)
                self.assertIn(f"/{page}.html", self.browser.run(first))
        self.assertEqual(self.browser.errors, [])

    def search(self, query):
        self.browser.run(f"""(() => {{
            const toggle = document.querySelector('[data-md-toggle=search]'), field = document.querySelector('[data-md-component=search-query]');
            if (!toggle.checked) toggle.click();
            field.value = {json.dumps(query)};
            field.dispatchEvent(new Event('keyup', {{bubbles: true}}));
        }})()""")


if __name__ == "__main__":
    unittest.main()
