"""Lists pages of the documentation, and extracts their headings, anchors, links and visible text."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^ *```")
DOCSTRING = re.compile(r"^::: ")  # with indented options below; mkdocstrings writes a docstring in its place
ITEM = re.compile(r"^ *(?:[-*]|\d+\.) +")


def documents():
    found = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "bench/README.md", "models/README.md")]
    return found + sorted((ROOT / "docs").rglob("*.md"))


def without_blocks(text):
    """Returns the text without code blocks and `:::` blocks. Their lines are empty, so that line numbers remain the same."""
    lines, in_code = [], False
    for line in text.split("\n"):
        is_fence = bool(FENCE.match(line))
        is_indented = line.startswith("    ") and not ITEM.match(line) and (not lines or not lines[-1].strip())
        lines.append("" if in_code or is_fence or is_indented or DOCSTRING.match(line) else line)
        in_code ^= is_fence
    return "\n".join(lines)


def without_code(text):
    return re.sub(r"`[^`\n]*`", lambda code: "x" * len(code.group()), without_blocks(text))


def slug_of(heading):
    """Returns the anchor that GitHub and MkDocs create for a heading."""
    heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")


def headings(text):
    """Returns [(line, level, title)] of a page."""
    matches = ((number, re.match(r"(#+) (.*)$", line)) for number, line in enumerate(without_blocks(text).split("\n"), 1))
    return [(number, len(match[1]), match[2]) for number, match in matches if match]


def anchors(path):
    found, seen = set(), {}
    for _, _, title in headings(path.read_text()):
        slug = slug_of(title)
        count = seen.get(slug, 0)
        seen[slug] = count + 1
        found.add(slug if count == 0 else f"{slug}-{count}")
    return found


def links(text):
    """Returns [(line, target)] of a page's links and images that lead to files and anchors of the repository."""
    found = []
    for number, line in enumerate(without_code(text).split("\n"), 1):
        found += [(number, target) for target in re.findall(r"\]\(([^)\s]+)\)", line) if not re.match(r"[a-z]+:", target)]
    return found


def blocks(text):
    """Returns [(kind, line, text)] of a page's blocks in order, without code and `:::` blocks. Kinds: "paragraph", "item" of a
    list, "cell" of a table, "heading". line: the block's first line."""
    found, is_open = [], False
    for number, line in enumerate(without_blocks(text).split("\n"), 1):
        stripped = line.strip()
        if not stripped or stripped.startswith("|") or re.match(r"#+ ", stripped) or ITEM.match(line):
            is_open = False
        if not stripped:
            continue
        if stripped.startswith("|"):
            cells = re.split(r"(?<!\\)\|", stripped.strip("|"))
            found += [("cell", number, cell.strip()) for cell in cells if re.search(r"\w", cell)]
        elif heading := re.match(r"#+ (.*)", stripped):
            found.append(("heading", number, heading[1]))
        elif is_open:
            kind, first, before = found[-1]
            found[-1] = (kind, first, f"{before} {stripped}")
        else:
            kind = "item" if ITEM.match(line) else "paragraph"
            found.append((kind, number, ITEM.sub("", line).strip()))
            is_open = True
    return found


def words(text):
    """Returns the visible words of a text. A piece of code counts as one word; of a link, only its text counts."""
    text = re.sub(r"`[^`]*`", "code", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return [word for word in text.split() if re.search(r"\w", word)]
