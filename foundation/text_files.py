"""JSON and YAML files that users write: a value, or the parser's error, whatever the text is."""

from __future__ import annotations

import json
from typing import Any

import yaml

LONGEST_NUMBER = 1000
"""Characters; a number beyond it is none that is meant, and Python refuses to print it."""

MOST_VALUES = 1_000_000
"""Values of a YAML document with its aliases written out, which a few lines can make any number of."""

LARGEST_YAML = 300_000
"""Characters; a loader written in Python takes seconds for as many."""


def parse_json(text: str) -> Any:
    """As `json.loads`; raises json.JSONDecodeError also for a number of too many digits and for what is nested too deeply."""
    try:
        return json.loads(text, parse_int=_integer)
    except json.JSONDecodeError:
        raise
    except RecursionError:
        raise json.JSONDecodeError("it is nested too deeply", text, 0) from None
    except ValueError as error:
        raise json.JSONDecodeError(str(error), text, 0) from None


def _integer(digits: str) -> int:
    if len(digits) > LONGEST_NUMBER:
        raise ValueError(f"a number has {len(digits)} digits")
    return int(digits)


def parse_yaml(text: str) -> Any:
    """As `yaml.safe_load`; raises yaml.YAMLError for every text that does not give a value of bounded size."""
    if len(text) > LARGEST_YAML:
        raise yaml.YAMLError(f"it has {len(text)} characters, {LARGEST_YAML} are read")
    loader = yaml.SafeLoader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _check(node, {})
        return loader.construct_document(node)
    except yaml.YAMLError:
        raise
    except RecursionError:
        raise yaml.YAMLError("it is nested too deeply") from None
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OverflowError) as error:
        # What the loader's constructors raise for a scalar that is not of its tag, as `!!bool x`.
        raise yaml.YAMLError(f"a value is not of its type: {error}") from None
    finally:
        loader.dispose()


def _check(node: yaml.Node, sizes: dict[int, int]) -> int:
    """Values in `node` with its aliases written out; raises YAMLError where they are too many, or a number too long.

    `sizes` by node: 0 while a node is being counted, for then it holds itself.
    """
    known = sizes.get(id(node))
    if known is not None:
        if known == 0:
            raise yaml.YAMLError("an alias stands inside of what it repeats")
        return known
    sizes[id(node)] = 0
    size = 1
    if isinstance(node, yaml.MappingNode):
        size += sum(_check(part, sizes) for pair in node.value for part in pair)
    elif isinstance(node, yaml.SequenceNode):
        size += sum(_check(part, sizes) for part in node.value)
    elif node.tag.endswith((":int", ":float")) and len(node.value) > LONGEST_NUMBER:
        raise yaml.YAMLError(f"line {node.start_mark.line + 1}: a number has {len(node.value)} digits")
    if size > MOST_VALUES:
        raise yaml.YAMLError(f"with its aliases written out it has more than {MOST_VALUES} values")
    sizes[id(node)] = size
    return size
