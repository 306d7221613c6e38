"""The built-in functions: their names and what they take and return.

A signature is written in letters, arguments before the colon and the result after it. Capitals stand for a scalar or
vector, all of the same length in one call (F float, I int, U uint, B bool); small letters for the scalar.
``3`` is vec3, ``V`` and ``W`` are B and F restricted to vectors.
"""

from __future__ import annotations

from .types import FLOAT, INT, UINT, Matrix, Numeric, Type, vector

_FLOATS = (
    "sin cos tan asin acos sinh cosh tanh exp log exp2 log2 sqrt inversesqrt floor ceil trunc round fract "
    "radians degrees"
)
_ALL_BASES = ("{0}{0}:{0}", "{0}{1}:{0}")
_MIN = tuple(form.format(a, a.lower()) for a in "FIU" for form in _ALL_BASES)
_COMPARE = ("WW:B", "II:B", "UU:B")

SIGNATURES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_FLOATS.split(), ("F:F",)),
    "atan": ("F:F", "FF:F"),
    "pow": ("FF:F",),
    "abs": ("F:F", "I:I"),
    "sign": ("F:F", "I:I"),
    "mod": ("FF:F", "Ff:F"),
    "min": _MIN,
    "max": _MIN,
    "clamp": tuple(form.format(a, a.lower()) for a in "FIU" for form in ("{0}{0}{0}:{0}", "{0}{1}{1}:{0}")),
    "mix": ("FFF:F", "FFf:F", "FFB:F"),
    "step": ("FF:F", "fF:F"),
    "smoothstep": ("FFF:F", "ffF:F"),
    "isnan": ("F:B",),
    "isinf": ("F:B",),
    "length": ("F:f",),
    "distance": ("FF:f",),
    "dot": ("FF:f",),
    "cross": ("33:3",),
    "normalize": ("F:F",),
    "reflect": ("FF:F",),
    "refract": ("FFf:F",),
    "any": ("V:b",),
    "all": ("V:b",),
    "not": ("V:V",),
    **dict.fromkeys(("lessThan", "lessThanEqual", "greaterThan", "greaterThanEqual"), _COMPARE),
    **dict.fromkeys(("equal", "notEqual"), (*_COMPARE, "VV:V")),
    "floatBitsToUint": ("F:U",),
    "uintBitsToFloat": ("U:F",),
    "expm1": ("f:f",),
    "log1p": ("f:f",),
    "transform": ("Mm:m", "Nn:n"),
}

_BASE = {"f": "float", "i": "int", "u": "uint", "b": "bool", "v": "bool", "w": "float"}

#: Field accessors: kinds of field, type of the position (None: there is none), type of the result.
ACCESSORS: dict[str, tuple[tuple[str, ...], Numeric | None, Numeric]] = {
    "sample3": (("field3",), vector(3), FLOAT),
    "fetch3": (("field3",), vector(3, "int"), FLOAT),
    "sample3v": (("field3v",), vector(3), vector(4)),
    "fetch3v": (("field3v",), vector(3, "int"), vector(4)),
    "fetch3u": (("field3u",), vector(3, "int"), UINT),
    "sample2": (("field2",), vector(2), vector(4)),
    "fetch2": (("field2",), vector(2, "int"), vector(4)),
    "fetch2u": (("field2u",), vector(2, "int"), UINT),
    "sample1": (("field1",), FLOAT, vector(4)),
    "fetch1": (("field1",), INT, vector(4)),
    "size3": (("field3", "field3v", "field3u"), None, vector(3, "int")),
    "size2": (("field2", "field2u"), None, vector(2, "int")),
    "size1": (("field1",), None, INT),
}

NAMES = frozenset(SIGNATURES) | frozenset(ACCESSORS)


def resolve(name: str, args: list[Type]) -> Type | None:
    """Return the type of the result of a built-in for these arguments, or None when no signature takes them."""
    for signature in SIGNATURES[name]:
        wanted, result = signature.split(":")
        if len(wanted) != len(args):
            continue
        n = _length(wanted, args)
        if n and all(_letter(letter, n) == arg for letter, arg in zip(wanted, args, strict=True)):
            return _letter(result, n)
    return None


def _length(wanted: str, args: list[Type]) -> int:
    """Return the common length of the generic arguments; 0 when a restricted one is a scalar."""
    for letter, arg in zip(wanted, args, strict=True):
        if letter in "FIUBVW" and isinstance(arg, Numeric):
            return 0 if letter in "VW" and arg.n == 1 else arg.n
    return 1


def _letter(letter: str, n: int) -> Type:
    special: dict[str, Type] = {"3": vector(3), "M": Matrix(4), "m": vector(4), "N": Matrix(3), "n": vector(3)}
    if letter in special:
        return special[letter]
    return Numeric(_BASE[letter.lower()], n if letter.isupper() else 1)


def describe(name: str) -> str:
    """Return the signatures of a built-in in words, for messages."""
    words = {
        "F": "float or vec", "I": "int or ivec", "U": "uint or uvec", "B": "bool or bvec", "V": "bvec", "W": "vec",
        "f": "float", "i": "int", "u": "uint", "b": "bool", "3": "vec3",
        "M": "mat4", "m": "vec4", "N": "mat3", "n": "vec3",
    }  # fmt: skip
    forms = [f"({', '.join(words[letter] for letter in form.split(':')[0])})" for form in SIGNATURES[name]]
    return " or ".join(forms)
