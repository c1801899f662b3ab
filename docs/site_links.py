"""For mkdocs, which reads pages otherwise than GitHub in two ways:

- links to files outside of docs/ become the names of these files, since the site does not hold them;
- a list or a table needs an empty line before it, which pages that are read as files go without.
"""

import re


def on_page_markdown(markdown, page, **_):
    depth = page.file.src_uri.count("/")
    outside = re.compile(r"\[([^\]]*)\]\((?:\.\./){%d}([^)#]*)[^)]*\)" % (depth + 1))
    return separate_blocks(outside.sub(lambda link: f"{link[1]} (`{link[2]}` in the repository)", markdown))


def separate_blocks(markdown):
    lines, in_code, before = [], False, ""
    for line in markdown.split("\n"):
        if line.startswith("```"):
            in_code = not in_code
        kind = "list" if re.match(r"([-*]|\d+\.) ", line) else "table" if line.startswith("|") else "text" if line.strip() else ""
        if before == "list" and kind == "text" and line.startswith(" "):
            kind = "list"  # an item goes on
        if not in_code and kind in ("list", "table") and before not in ("", kind):
            lines.append("")
        lines.append(line)
        before = "" if in_code else kind
    return "\n".join(lines)
