"""Checks that docs/how-to/cpp_library.md contains the source of the consumer that tests build, unchanged.

Usage: check_documents.py REPOSITORY. Prints differences and exits with 1 if there are any.
"""

import pathlib
import sys

root = pathlib.Path(sys.argv[1])
document = (root / "docs/how-to/cpp_library.md").read_text()
missing = [
    name
    for name, language in [("CMakeLists.txt", "cmake"), ("main.cpp", "cpp")]
    if f"```{language}\n{(root / 'tests/install/consumer' / name).read_text()}```\n" not in document
]
for name in missing:
    print(f"docs/how-to/cpp_library.md: expected the text of tests/install/consumer/{name} in a block")
sys.exit(bool(missing))
