"""`cached_property` as of Python 3.12, without a lock: that of 3.11 holds one for all objects of a class.

There threads that work on objects of their own wait for each other. Here two that ask one object at once may both compute.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property
else:
    import functools

    class cached_property(functools.cached_property):  # noqa: N801  # the name that everybody knows
        """Computed when it is first asked for, then an attribute of its object."""

        def __get__(self, instance, owner=None):
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


__all__ = ["cached_property"]
