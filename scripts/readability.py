"""How readable pages are, at an earlier commit and now: words per sentence, long sentences, words that the glossary replaces.

Example: python scripts/readability.py --before 53721ff README.md docs/bus.md

Only prose counts: paragraphs and list items. Code blocks, tables, headings, images, comments and lists of sources do not.
Code in a line, such as a command, a path or a formula, is one word.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GLOSSARY, REPLACED = ROOT / "docs/glossary.md", "## Words that the terms replace"
BEFORE = "53721ff"
TWELVE = (
    "README.md",
    "docs/bus.md",
    "docs/drive-types.md",
    "docs/modbus.md",
    "docs/acceptance.md",
    "docs/acceptance-ci.md",
    "docs/faults.md",
    "docs/import.md",
    "docs/identification.md",
    "docs/diagnosis.md",
    "docs/effects.md",
    "docs/excite.md",
)
"""The pages that a user meets first and that had their present names before."""
LONG = 25
"""Words above which a sentence is long."""
ABBREVIATIONS = ("al", "ch", "eq", "sec", "vs", "e.g", "i.e")
"""What their full stop ends is no sentence, and neither is an initial."""
ITEM = re.compile(r"\s{0,3}(?:[-*+]|\d+\.)\s+")
END = re.compile(r"(?<=[.?!])[*)\"']*\s+(?=[`*(\"'\[]*[A-Z0-9`]|\*\*)")


class ReadabilityError(Exception):
    """A page or the list of words cannot be read."""


@dataclass(frozen=True)
class Counts:
    """Of the prose of a page, or of several: counts add up."""

    words: int = 0
    sentences: int = 0
    long: int = 0
    replaced: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.words + other.words,
            self.sentences + other.sentences,
            self.long + other.long,
            self.replaced + other.replaced,
        )

    @property
    def mean(self) -> float:
        """Words per sentence."""
        return self.words / max(self.sentences, 1)

    @property
    def share(self) -> float:
        """Of the sentences, those that are long."""
        return self.long / max(self.sentences, 1)


def blocks(page: str) -> list[str]:
    """The paragraphs and list items of a page in Markdown, each on one line."""
    found: list[list[str]] = [[]]
    for line in _text(page):
        item = ITEM.match(line)
        if not line or item:
            found.append([])
        if line:
            found[-1].append(line[item.end() if item else 0 :].strip())
    return [_plain(" ".join(lines)) for lines in found if lines]


def _text(page: str) -> Iterator[str]:
    """The lines of prose; an empty line stands for all that is not."""
    fenced = code = False
    begins = True
    for line in re.split(r"^## Sources$", page, maxsplit=1, flags=re.MULTILINE)[0].splitlines():
        if line.lstrip().startswith("```"):
            fenced = not fenced
            yield ""
            continue
        code = (line.startswith("    ") and (code or begins)) or (code and not line.strip())
        other = line.lstrip().startswith(("|", "#", "<!--", "![")) or not line.strip()
        begins = other and not line.lstrip().startswith("|")
        yield "" if fenced or code or other else line


def _plain(text: str) -> str:
    """Of a link its text; of code in a line one word, by which a sentence may begin."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"`[^`]*`", "`code`", text)


def sentences(block: str) -> list[str]:
    """A semicolon or a colon ends none."""
    parts: list[str] = []
    joined = False
    for part in END.split(block):
        if joined:
            parts[-1] += " " + part
        else:
            parts.append(part)
        joined = re.search(rf"(?:\b(?:{'|'.join(map(re.escape, ABBREVIATIONS))})|\b[A-Z])\.$", part) is not None
    return [part for part in parts if words(part)]


def words(text: str) -> list[str]:
    """What stands between blanks and has a letter or a digit."""
    return [word for word in text.split() if re.search(r"\w", word)]


def replaced_words(glossary: str) -> re.Pattern[str]:
    """What the glossary's terms replace, from the first column of its table; `...` in it is one to six words."""
    _, heading, table = glossary.partition(REPLACED)
    cells = re.findall(r"^\| ([^|]+) \|", table.split("\n## ", 1)[0], flags=re.MULTILINE)[2:]
    forms = [form.strip() for cell in cells for form in cell.split(",")]
    if not heading or not forms:
        message = f"no words in the section {REPLACED!r} of the glossary"
        raise ReadabilityError(message)
    longest_first = sorted(forms, key=len, reverse=True)
    patterns = [re.escape(form).replace(r"\ \.\.\.\ ", r"(?:\s+[^\s.;:]+){1,6}\s+") for form in longest_first]
    return re.compile(rf"\b(?:{'|'.join(patterns)})\b", flags=re.IGNORECASE)


def count(page: str, replaced: re.Pattern[str]) -> Counts:
    """Of a page in Markdown."""
    prose = blocks(page)
    lengths = [len(words(sentence)) for block in prose for sentence in sentences(block)]
    return Counts(
        sum(lengths),
        len(lengths),
        sum(length > LONG for length in lengths),
        sum(len(replaced.findall(block)) for block in prose),
    )


def at(commit: str, path: str) -> str:
    """A page as a commit has it."""
    done = subprocess.run(["git", "show", f"{commit}:{path}"], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        message = f"{path} at {commit}: {done.stderr.strip()}"
        raise ReadabilityError(message)
    return done.stdout


def table(counts: dict[str, tuple[Counts, Counts]]) -> list[str]:
    """Lines of Markdown, each page before and now, all together in the last one."""
    total = tuple(sum((pair[side] for pair in counts.values()), Counts()) for side in (0, 1))
    rows = [
        f"| page | words | words per sentence | sentences above {LONG} words | replaced words |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, (old, new) in [*counts.items(), ("all", (total[0], total[1]))]:
        cells = (
            f"{old.words:,} to {new.words:,}",
            f"{old.mean:.1f} to {new.mean:.1f}",
            f"{old.share:.0%} to {new.share:.0%}".replace("%", " %"),
            f"{old.replaced} to {new.replaced}",
        )
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="*", default=TWELVE, metavar="PAGE", help="relative to the project; twelve by default")
    parser.add_argument("--before", default=BEFORE, metavar="COMMIT")
    parser.add_argument("--long", action="store_true", help="list the long sentences and replaced words of today instead")
    options = parser.parse_args(arguments)
    try:
        replaced = replaced_words(GLOSSARY.read_text(encoding="utf-8"))
        pages = {path: (ROOT / path).read_text(encoding="utf-8") for path in options.pages}
        if options.long:
            sys.stdout.writelines(line + "\n" for path, page in pages.items() for line in _hard(path, page, replaced))
            return 0
        counts = {path: (count(at(options.before, path), replaced), count(page, replaced)) for path, page in pages.items()}
    except (ReadabilityError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write("\n".join(table(counts)) + "\n")
    return 0


def _hard(path: str, page: str, replaced: re.Pattern[str]) -> Iterator[str]:
    for sentence in (sentence for block in blocks(page) for sentence in sentences(block)):
        found = replaced.findall(sentence)
        if found or len(words(sentence)) > LONG:
            yield f"{path}: {len(words(sentence))} words{''.join(f', {word!r}' for word in found)}: {sentence}"


if __name__ == "__main__":
    sys.exit(main())
