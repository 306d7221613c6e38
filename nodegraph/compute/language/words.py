"""Words that a kernel author may not use as names, and words of GLSL that the language leaves out."""

from __future__ import annotations

#: Words with a meaning in the language.
KEYWORDS = frozenset("if else for while do break continue return const uniform struct in true false defined".split())

_RETURN = "return a value, or a struct for several"
_PRECISION = "leave precision qualifiers out"
_SAMPLE = "declare a field and read it by sample3, fetch3, sample2 or sample1"
_ORDER = "steps that need order are several runs of kernels"
_MATRIX = "use mat3 or mat4 with transform(m, v)"

#: Words of GLSL that are refused, each with what to write instead.
NOT_IN_LANGUAGE: dict[str, str] = {
    "out": _RETURN,
    "inout": _RETURN,
    "discard": "return a flag beside the result",
    "switch": "write if and else",
    "case": "write if and else",
    "default": "write if and else",
    "goto": "write loops and functions",
    "layout": "the translator chooses locations and bindings",
    "varying": "a kernel has uniforms and fields only",
    "attribute": "a kernel has uniforms and fields only",
    "buffer": "large data is a field",
    "shared": _ORDER,
    "barrier": _ORDER,
    "memoryBarrier": _ORDER,
    "groupMemoryBarrier": _ORDER,
    "double": "float is the real number of the device, double where that was asked for",
    "dvec2": "vec2 has the precision of the device",
    "dvec3": "vec3 has the precision of the device",
    "dvec4": "vec4 has the precision of the device",
    "precision": _PRECISION,
    "highp": _PRECISION,
    "mediump": _PRECISION,
    "lowp": _PRECISION,
    "flat": "a kernel has no varyings",
    "smooth": "a kernel has no varyings",
    "noperspective": "a kernel has no varyings",
    "invariant": "leave it out",
    "precise": "leave it out",
    "mat2": _MATRIX,
    "texture": _SAMPLE,
    "textureLod": _SAMPLE,
    "textureGrad": _SAMPLE,
    "textureSize": "use size3, size2 or size1 of a field",
    "texelFetch": "use fetch3, fetch2 or fetch1 of a field",
    "imageLoad": _SAMPLE,
    "imageStore": _RETURN,
    "dFdx": "compute the difference between two positions",
    "dFdy": "compute the difference between two positions",
    "fwidth": "compute the difference between two positions",
    "matrixCompMult": _MATRIX,
    "transpose": "pass the transposed matrix as a uniform",
    "inverse": "pass the inverse matrix as a uniform",
    "determinant": "pass the determinant as a uniform",
    "outerProduct": _MATRIX,
    "fma": "write a * b + c",
    "modf": "use floor or fract",
    "frexp": "use log2 and floor",
    "roundEven": "round is to the nearest even already",
    "faceforward": "write dot(a, b) < 0.0 ? n : -n",
    "floatBitsToInt": "use floatBitsToUint and int(...)",
    "intBitsToFloat": "use uintBitsToFloat",
    "asinh": "write it by log and sqrt",
    "acosh": "write it by log and sqrt",
    "atanh": "write it by log",
    **{f"mat{a}x{b}": _MATRIX for a in (2, 3, 4) for b in (2, 3, 4)},
    **{
        f"{letter}sampler{shape}": _SAMPLE
        for letter in ("", "i", "u")
        for shape in ("1D", "2D", "3D", "Cube", "2DArray")
    },
    **{f"{letter}image{shape}": _SAMPLE for letter in ("", "i", "u") for shape in ("1D", "2D", "3D")},
    **{f"atomic{name}": _ORDER for name in ("Add", "Min", "Max", "And", "Or", "Xor", "Exchange", "CompSwap")},
}
