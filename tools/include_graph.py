"""The #include lines of our own C++ files, and what they refer to."""

import functools
import pathlib
import re

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^">]+)[">]')
SUFFIXES = {".h", ".cpp"}


@functools.cache
def includes(path):
    """(line number, text, quoted?) of every include line of a file; comments spanning lines are not looked into."""
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if match := INCLUDE.match(line):
            found.append((number, match[2], match[1] == '"'))
    return found


def resolve(root, path, text, quoted):
    """The file of this repository that an include names, or None."""
    candidates = [path.parent / text] if quoted else []
    candidates.append(root / "src" / text)
    return next((c.resolve() for c in candidates if c.is_file()), None)


def sources(folder):
    return sorted(p for p in pathlib.Path(folder).rglob("*") if p.suffix in SUFFIXES)


def closure(root, path):
    """The file and every file of this repository that it includes, directly or not."""
    seen, todo = set(), [path.resolve()]
    while todo:
        if (current := todo.pop()) not in seen:
            seen.add(current)
            targets = (resolve(root, current, text, quoted) for _, text, quoted in includes(current))
            todo += [t for t in targets if t]
    return seen
