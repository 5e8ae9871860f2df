"""Exceptions with two bases."""

from ._matdb import MaterialError


class UnknownMaterialError(MaterialError, KeyError):
    """There is no material of this name: a `KeyError`, too, as a mapping raises it."""

    __str__ = Exception.__str__
