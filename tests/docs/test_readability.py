"""The counts of `scripts/readability.py` on a page counted by hand, and what its twelve pages keep."""

from __future__ import annotations

import subprocess

import pytest
import readability
from readability import Counts

GLOSSARY = f"""# Glossary

| term | meaning |
| --- | --- |
| axis | one driven joint |

{readability.REPLACED}

| not | but |
| --- | --- |
| copper, a yes | physical bus; confirmation |
| hold ... against | compare with |
"""

PAGE = """# A heading is no sentence. Nor is this one.

The drives wait, as [real drives](bus.md#copper) do. They answer
`drivetwin emulate --bus copper` by 1.5 s (Schwarz et al. 1978, sec. 4.2) at 90 %; see L. Kish.

    copper is not counted here. Nor

    here.

| copper | in a table. And again. |
| --- | --- |

![A plot of copper.](images/copper.png)
<!-- copper -->

1. Hold the values of both drives against the limits: on copper, give a yes.
   **Then** stop!
2. One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen nineteen
   twenty twenty-one twenty-two twenty-three twenty-four twenty-five; twenty-six.

```sh
copper
```

One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen seventeen eighteen nineteen
twenty twenty-one twenty-two twenty-three twenty-four twenty-five. `code` begins a sentence. **It_does** too.

## Sources

- A. Author, Journal of Copper, 1978.
"""

SENTENCES = (
    ("The drives wait, as real drives do.", 7),
    ("They answer `code` by 1.5 s (Schwarz et al. 1978, sec. 4.2) at 90 %; see L. Kish.", 17),
    ("Hold the values of both drives against the limits: on copper, give a yes.", 14),
    ("**Then** stop!", 2),
    ("One ... twenty-six.", 26),
    ("One ... twenty-five.", 25),
    ("`code` begins a sentence.", 4),
    ("**It_does** too.", 2),
)
"""Of the page, with the words of each."""


def test_a_page_has_the_counts_that_a_reader_counts() -> None:
    found = readability.count(PAGE, readability.replaced_words(GLOSSARY))
    assert found == Counts(words=sum(words for _, words in SENTENCES), sentences=len(SENTENCES), long=1, replaced=3)
    assert found.mean == 97 / 8
    assert found.share == 1 / 8


def test_sentences_end_where_a_reader_ends_them() -> None:
    found = [sentence for block in readability.blocks(PAGE) for sentence in readability.sentences(block)]
    assert [len(readability.words(sentence)) for sentence in found] == [words for _, words in SENTENCES]
    assert [sentence for sentence in found if len(sentence) < 90] == [text for text, _ in SENTENCES if "..." not in text]


def test_replaced_words_are_whole_words_in_any_case() -> None:
    replaced = readability.replaced_words(GLOSSARY)
    assert replaced.findall("Copper, coppersmith, A yes, yes; holding one against two, hold it against them.") == [
        "Copper",
        "A yes",
        "hold it against",
    ]


def test_a_glossary_without_the_list_is_refused() -> None:
    with pytest.raises(readability.ReadabilityError, match="no words in the section"):
        readability.replaced_words("# Glossary\n\n| term | meaning |\n| --- | --- |\n| axis | one driven joint |\n")


def test_counts_of_pages_add_up_and_stand_in_the_last_row() -> None:
    pages = {"a.md": (Counts(40, 2, 1, 3), Counts(30, 3, 0, 0)), "b.md": (Counts(60, 2, 1, 1), Counts(1170, 97, 1, 0))}
    assert readability.table(pages)[2:] == [
        "| a.md | 40 to 30 | 20.0 to 10.0 | 50 % to 0 % | 3 to 0 |",
        "| b.md | 60 to 1,170 | 30.0 to 12.1 | 50 % to 1 % | 1 to 0 |",
        "| all | 100 to 1,200 | 25.0 to 12.0 | 50 % to 1 % | 4 to 0 |",
    ]


@pytest.mark.parametrize("path", readability.TWELVE)
def test_a_page_uses_the_words_of_the_glossary(path: str) -> None:
    replaced = readability.replaced_words(readability.GLOSSARY.read_text(encoding="utf-8"))
    page = (readability.ROOT / path).read_text(encoding="utf-8")
    assert [block for block in readability.blocks(page) if replaced.search(block)] == []


def test_hard_sentences_are_listed_with_their_page(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(readability, "LONG", 0)
    assert readability.main(["--long", "docs/excite.md"]) == 0
    lines = capsys.readouterr().out.splitlines()
    page = (readability.ROOT / "docs/excite.md").read_text(encoding="utf-8")
    assert len(lines) == sum(len(readability.sentences(block)) for block in readability.blocks(page))
    assert all(line.startswith("docs/excite.md: ") for line in lines)


def test_a_page_that_a_commit_lacks_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    inside = subprocess.run(["git", "rev-parse", "HEAD"], cwd=readability.ROOT, capture_output=True, check=False)
    if inside.returncode != 0:
        pytest.skip("not a checkout of the repository")
    assert readability.main(["--before", "HEAD", "docs/bus.md"]) == 0
    assert capsys.readouterr().out.count("\n") == 4
    assert readability.main(["--before", "0" * 40, "docs/bus.md"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("docs/bus.md at 0000")
    assert error.count("\n") == 1
