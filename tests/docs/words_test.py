"""Tests the style of pages: lengths, turns, headings, links and navigation. Prints FILE:LINE and the rule for each violation.

Run by ctest: python3 words_test.py [unittest arguments]. Also
    python3 words_test.py --report      prints the words of each page and all violations, also on exempt pages
    python3 words_test.py --comments    prints forbidden turns in comments, docstrings, messages and help texts of sources
"""

import ast
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
# Comment, raw string, string or character of C++.
CPP_TOKEN = re.compile(
    r"""//[^\n]*|/\*.*?\*/|R"(?P<mark>[^(\s"]*)\((?P<raw>.*?)\)(?P=mark)"|"(?P<text>(?:[^"\\\n]|\\.)*)"|(?<!\w)'(?:[^'\\\n]|\\[^\n]+?)'""",
    re.DOTALL,
)
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


def string_literals(path):
    """Returns [(line, text)] of the strings of a C++ or Python file. Joins adjacent strings; an f-string's values become "{}"."""
    source = path.read_text(errors="replace")
    if path.suffix in (".h", ".cpp", ".cu", ".cuh"):
        return cpp_strings(source)
    if path.suffix in (".py", ".pyi") or source.startswith("#!/usr/bin/env python"):
        return list(python_strings(ast.parse(source)))
    return []


def cpp_strings(source):
    found, end = [], None
    for match in CPP_TOKEN.finditer(source):
        text = match["raw"] if match["raw"] is not None else match["text"]
        if text is None:
            continue
        if match["raw"] is None:
            text = text.replace("\\n", "\n\n").replace('\\"', '"')
        if found and not source[end : match.start()].strip():
            found[-1] = (found[-1][0], found[-1][1] + text)
        else:
            found.append((source.count("\n", 0, match.start()) + 1, text))
        end = match.end()
    return found


def python_strings(node):
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.JoinedStr):
            yield child.lineno, "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in child.values)
        elif isinstance(child, ast.Constant) and isinstance(child.value, str) and not isinstance(node, ast.Expr):
            yield child.lineno, child.value
        else:
            yield from python_strings(child)


def messages(path):
    """Returns [(line, text)] of the paragraphs of a source file's strings that have several words."""
    found = [(line, " ".join(part.split("\n"))) for line, text in string_literals(path) for part in text.split("\n\n")]
    return [(line, text) for line, text in found if re.search(r"\w\s+\w", text)]


def sources():
    """Returns the paths of the repository's sources, also of untracked ones."""
    top = [path for path in sorted(ROOT.iterdir()) if path.name[0] != "." and path.name not in GENERATED]
    paths = [inner for path in top for inner in ([path] if path.is_file() else sorted(path.rglob("*")))]
    return [path for path in paths if path.is_file() and any(fnmatch.fnmatch(name_of(path), pattern) for pattern in SOURCES)]


def comment_violations():
    found = []
    for path in sources():
        if path != pathlib.Path(__file__).resolve():
            # Strings of tests are data, names of assertions and quoted messages.
            texts = comments(path) + ([] if name_of(path).startswith("tests/") else messages(path))
            for line, text in texts:
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
        self.assertTrue(any("Each rule finds" in text for _, text in comments(path)))
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "a.h"
            source.write_text("// One\n// comment.\nint a;  // of a\nint b;  // of b\n        // and c\n")
            self.assertEqual([text for _, text in comments(source)], ["One comment.", "of a", "of b and c"])


    def test_turns_in_messages_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, source in {
                "a.cpp": "const char *a = \"nobody\", *b = \"one\\n\"\n  \"whose weights are drawn \"\n  \"anew\"; // x \" y\nint c = 1'000; char d = '\"';\n",
                "b.cpp": 'auto help = R"(A\nfirst paragraph.\n\nIts weights are drawn\nanew.)";\n',
                "c.py": 'a = "nobody"\nfail(f"whose weights of {a} are drawn "\n     "anew")\n',
            }.items():
                path = pathlib.Path(folder) / name
                path.write_text(source)
                turns = [turn for _, text in messages(path) for turn, _ in turns_in(text)]
                self.assertEqual(turns, ["anew"], name)


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
        print("\n".join([*found, f"{len(found)} turns in comments and messages"]))
    elif "--report" in sys.argv:
        report()
    else:
        unittest.main()
