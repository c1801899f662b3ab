"""Tests the style of pages: lengths, turns, headings, links and navigation. Prints FILE:LINE and the rule for each violation.

Run by ctest: python3 words_test.py [unittest arguments]. Also
    python3 words_test.py --report      prints the words of each page and all violations, also on exempt pages
    python3 words_test.py --comments    prints forbidden turns in comments and docstrings of sources
"""

import collections
import fnmatch
import io
import pathlib
import re
import sys
import tempfile
import tokenize
import unittest

import pages

ROOT = pages.ROOT
PAGE_WORDS = 1500
README_WORDS = 700
TOTAL_WORDS = 35_000  # of docs/ without research and generated pages
PARAGRAPH_WORDS = 120
CELL_WORDS = 12
LENGTH = {"page", "total", "paragraph", "cell"}
ALL = LENGTH | {"turn"}
# Rules that do not hold for a page: programs or tests write it, tests compare its tables, or it is a record of experiments.
EXEMPT = {
    "docs/reference/commands/*.md": ALL,  # tests/docs/commands.py
    "docs/reference/environment.md": {"page", "total", "cell"},  # scripts/environment_card
    "docs/reference/configuration.md": {"page", "total", "cell"},  # tests/configuration/config_test.cpp
    "docs/reference/opendrive_conformance.md": ALL,  # tests/map/opendrive_elements_test.cpp and ..._conformance_test.cpp
    "docs/changelog/*.md": {"total"},  # CHANGELOG.md by version
    "docs/research/*.md": ALL,
    "docs/developer/*.md": {"page"},
    "CONTRIBUTING.md": {"page"},
}
GENERATED = {"build", "carry", "out", "runs"}
SOURCES = ("*.h", "*.cpp", "*.cu", "*.cuh", "*.py", "*.pyi", "*.cmake", "*CMakeLists.txt", "scripts/*")


def forbidden_turns():
    """Returns [(pattern, what to write instead)]."""
    lines = (pathlib.Path(__file__).parent / "forbidden_turns.txt").read_text().splitlines()
    pairs = [line.split(" => ") for line in lines if line and not line.startswith("#")]
    return [(re.compile(pattern, re.IGNORECASE), instead) for pattern, instead in pairs]


TURNS = forbidden_turns()


def turns_in(text):
    text = re.sub(r"`[^`]*`|(?<!\w)'\w+'", "``", text)
    text = re.sub(r"\]\([^)]*\)", "]", text).replace("*", "")
    return [(match.group(), instead) for pattern, instead in TURNS for match in pattern.finditer(text)]


def violations(text, page_words=PAGE_WORDS):
    """Returns [(line, rule, message)] of a page."""
    found = []
    length = len(pages.words(pages.without_blocks(text)))
    if length > page_words:
        found.append((1, "page", f"the page has {length} words; at most {page_words}"))
    for kind, line, block in pages.blocks(text):
        length = len(pages.words(block))
        if kind in ("paragraph", "item") and length > PARAGRAPH_WORDS:
            found.append((line, "paragraph", f"the {kind} has {length} words; at most {PARAGRAPH_WORDS}"))
        if kind == "cell" and length > CELL_WORDS:
            found.append((line, "cell", f"the cell has {length} words; at most {CELL_WORDS}: {block}"))
        found += [(line, "turn", f"'{turn}': {instead}") for turn, instead in turns_in(block)]
    return found + heading_violations(text)


def heading_violations(text):
    found, level_before, seen = [], 0, {}
    for line, level, title in pages.headings(text):
        if level > level_before + 1:
            found.append((line, "heading", f"'{title}' has level {level} after level {level_before}"))
        if level == 1 and level_before:
            found.append((line, "heading", f"'{title}' is a second title"))
        slug = pages.slug_of(title)
        if slug in seen:
            found.append((line, "heading", f"'{title}' is also the heading of line {seen[slug]}"))
        seen.setdefault(slug, line)
        level_before = level
    if not seen:
        found.append((1, "heading", "the page has no title"))
    return found


def dead_links(path):
    found = []
    for line, target in pages.links(path.read_text()):
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        if not there.exists():
            found.append((line, "link", f"{target}: no such file"))
        elif anchor and there.suffix == ".md" and anchor not in pages.anchors(there):
            found.append((line, "link", f"{target}: the page has no such heading"))
    return found


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def exempt_from(name):
    return set().union(*(rules for pattern, rules in EXEMPT.items() if fnmatch.fnmatch(name, pattern)))


def page_violations(path, with_exempt=False):
    name = name_of(path)
    found = violations(path.read_text(), README_WORDS if name == "README.md" else PAGE_WORDS) + dead_links(path)
    exempt = set() if with_exempt else exempt_from(name)
    return [f"{name}:{line}: {message} [{rule}]" for line, rule, message in sorted(found) if rule not in exempt]


def counted_words():
    """Returns {page: words} for pages of docs/ that count towards TOTAL_WORDS."""
    counted = {}
    for path in pages.documents():
        name = name_of(path)
        if name.startswith("docs/") and "total" not in exempt_from(name):
            counted[name] = len(pages.words(pages.without_blocks(path.read_text())))
    return counted


def comments(path):
    """Returns [(line, text)] of a source file's comments. Joins consecutive lines; a comment after code begins a new entry."""
    text = path.read_text(errors="replace")
    lines = []
    if path.suffix in (".py", ".pyi") or text.startswith("#!/usr/bin/env python"):
        try:
            for token in tokenize.generate_tokens(io.StringIO(text).readline):
                if token.type == tokenize.COMMENT:
                    lines.append((token.start[0], token.string.lstrip("#! "), bool(token.line[: token.start[1]].strip())))
                elif token.type == tokenize.STRING and token.string.lstrip("rRbBfF").startswith('"""'):
                    lines += [(token.start[0] + i, part.strip(' "'), i == 0) for i, part in enumerate(token.string.split("\n"))]
        except (tokenize.TokenError, SyntaxError):
            return []
    else:
        mark = r"//[/!]?<?" if path.suffix in (".h", ".cpp", ".cu", ".cuh") else r"#"
        for number, line in enumerate(text.split("\n"), 1):
            if match := re.search(rf"(?:^|\s){mark} ?(.*)$", line):
                lines.append((number, match[1].strip(), bool(line[: match.start()].strip())))
    joined = []
    for number, line, begins in lines:
        if joined and joined[-1][2] == number - 1 and line and joined[-1][1] and not begins:
            joined[-1] = (joined[-1][0], f"{joined[-1][1]} {line}", number)
        else:
            joined.append((number, line, number))
    return [(number, line) for number, line, _ in joined]


def sources():
    """Returns the paths of the repository's sources, also of untracked ones."""
    top = [path for path in sorted(ROOT.iterdir()) if path.name[0] != "." and path.name not in GENERATED]
    paths = [inner for path in top for inner in ([path] if path.is_file() else sorted(path.rglob("*")))]
    return [path for path in paths if path.is_file() and any(fnmatch.fnmatch(name_of(path), pattern) for pattern in SOURCES)]


def comment_violations():
    found = []
    for path in sources():
        if path != pathlib.Path(__file__).resolve():
            for line, text in comments(path):
                found += [f"{name_of(path)}:{line}: '{turn}': {instead}" for turn, instead in turns_in(text)]
    return found


def report():
    for path in pages.documents():
        print(f"{len(pages.words(pages.without_blocks(path.read_text()))):6}  {name_of(path)}")
    counted = counted_words()
    print(f"{sum(counted.values()):6}  in all {len(counted)} pages that count; at most {TOTAL_WORDS}\n")
    for path in pages.documents():
        print("".join(f"{line}\n" for line in page_violations(path, with_exempt=True)), end="")


class Rules(unittest.TestCase):
    """Each rule finds the violations that it describes."""

    def rules(self, text, **options):
        return sorted({rule for _, rule, _ in violations(text, **options)})

    def test_a_good_page_has_no_violations(self):
        text = "# Title\nA sentence.\n\n## One\n- an item\n\n| a | b |\n|---|---|\n| `nobody` | 1 |\n\n```\n# nobody\n```\n"
        self.assertEqual(violations(text), [])

    def test_lengths(self):
        self.assertEqual(self.rules("# T\n" + "a b. \n\n" * 10, page_words=20), ["page"])
        self.assertEqual(self.rules("# T\n" + "a.\n\n    a command of many words\n    another one\n\n" * 10, page_words=20), [])
        self.assertEqual(self.rules("# T\n" + "word\n" * 121), ["paragraph"])
        self.assertEqual(self.rules("# T\n- " + "word " * 121), ["paragraph"])
        self.assertEqual(self.rules("# T\n" + "- word\n" * 121), [])
        self.assertEqual(self.rules("# T\n| " + "word " * 13 + "|\n"), ["cell"])
        self.assertEqual(self.rules("# T\n|" + " word |" * 13 + "\n"), [])

    def test_only_docstrings_of_a_reference_are_exempt(self):
        text = "# T\nIntroduction.\n\n::: pictura.whoever\n    options:\n      show_source: false\n\nA sentence.\n"
        self.assertEqual(violations(text, page_words=4), [])
        self.assertEqual(self.rules(text, page_words=3), ["page"])
        self.assertEqual(violations(text + "\nwhoever\n")[0][:2], (10, "turn"))
        self.assertEqual(self.rules(text.replace("::: ", "")), ["turn"])
        self.assertFalse(exempt_from("docs/reference/python/index.md"))

    def test_turns_with_their_lines(self):
        self.assertEqual(violations("# T\ntext\n\nWhoever comes\n")[0][:2], (4, "turn"))
        self.assertEqual(self.rules("# T\n| a | of a world |\n"), ["turn"])
        self.assertEqual(self.rules("# T\nmeasured at f569d7d\n"), ["turn"])
        self.assertEqual(self.rules("# T\n1280 worlds of 2026\n"), [])

    def test_headings(self):
        for text in ("no title\n", "# T\n### skipped\n", "# T\n## A\n## A\n", "# T\n# second\n"):
            self.assertEqual(self.rules(text), ["heading"], text)

    def test_dead_links(self):
        page = ROOT / "README.md"
        self.assertIn("licence", pages.anchors(page))
        self.assertEqual(pages.links("[a](b.md#c) `[d](e)`\n![f](g.png) [h](https://i)"), [(1, "b.md#c"), (2, "g.png")])
        self.assertGreater(len(pages.links(page.read_text())), 10)

    def test_comments_are_found(self):
        path = pathlib.Path(__file__)
        self.assertIn(' Rules that do not hold'.strip(), " ".join(text for _, text in comments(path)))
        self.assertTrue(any("each rule finds" in text for _, text in comments(path)))
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "a.h"
            source.write_text("// One\n// comment.\nint a;  // of a\nint b;  // of b\n        // and c\n")
            self.assertEqual([text for _, text in comments(source)], ["One comment.", "of a", "of b and c"])


class Comments(unittest.TestCase):
    maxDiff = 0  # the message lists the violations

    def test_comments_have_no_forbidden_turns(self):
        self.assertGreater(len(sources()), 500)
        found = comment_violations()
        self.assertEqual(found, [], "\n" + "\n".join(found))


class Pages(unittest.TestCase):
    maxDiff = 0  # the messages list the violations

    def test_pages_follow_the_rules(self):
        found = [line for path in pages.documents() for line in page_violations(path)]
        rules = collections.Counter(line.rsplit("[", 1)[1].rstrip("]") for line in found)
        self.assertEqual(found, [], "\n" + "\n".join([*found, f"violations by rule: {dict(rules)}"]))

    def test_the_total_is_bounded(self):
        counted = counted_words()
        listing = "\n".join(f"{count:6}  {name}" for name, count in sorted(counted.items(), key=lambda item: -item[1]))
        self.assertLessEqual(sum(counted.values()), TOTAL_WORDS, f"words of docs/ without research and generated pages:\n{listing}")

    def test_every_page_is_in_the_navigation(self):
        navigation = set(re.findall(r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text()))
        self.assertEqual(navigation, {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")})


if __name__ == "__main__":
    if "--comments" in sys.argv:
        found = comment_violations()
        print("\n".join([*found, f"{len(found)} turns in comments"]))
    elif "--report" in sys.argv:
        report()
    else:
        unittest.main()
