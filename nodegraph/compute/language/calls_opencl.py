"""Types, operators, constructors and built-in calls in OpenCL C."""

from __future__ import annotations

from collections.abc import Callable

from . import prelude_opencl as prelude
from . import syntax as s
from .module import Module
from .names import mangle
from .print_glsl import literal
from .printing import Printer, Storages, divides_plainly
from .types import Array, Matrix, Numeric, Struct, Type

_COMPARE = {
    "lessThan": "<", "lessThanEqual": "<=", "greaterThan": ">", "greaterThanEqual": ">=",
    "equal": "==", "notEqual": "!=",
}  # fmt: skip


class CallPrinter(Printer):
    """What OpenCL C writes for one operation. ``real`` names the type of the language's float."""

    real = "float"

    def __init__(self, module: Module, storages: Storages) -> None:
        super().__init__(module, storages)
        self.declared: dict[str, str] = {}

    # Types

    def type(self, type: Type) -> str:
        """bool is int (0 or 1), a bool vector an int vector (0 or -1), an array a struct, so that it is copied."""
        if isinstance(type, Numeric):
            base = {"float": "real", "bool": "int"}.get(type.base, type.base)
            return f"{base}{type.n if type.n > 1 else ''}"
        if isinstance(type, Matrix):
            return self.declare_type(f"mat{type.n}", prelude.MATRIX.format(n=type.n))
        if isinstance(type, Array):
            element = self.type(type.element)
            name = f"ng_{type.count}_{element}"
            return self.declare_type(name, f"typedef struct {{ {element} a[{type.count}]; }} {name};")
        assert isinstance(type, Struct)
        name = mangle("s", type.name)
        if name not in self.declared:
            members = " ".join(f"{self.type(part)} {mangle('m', member)};" for member, part in type.members)
            self.declare_type(name, f"typedef struct {{ {members} }} {name};")
        return name

    def declare_type(self, name: str, text: str) -> str:
        self.declared.setdefault(name, text)
        return name

    # Operators

    def literal(self, expr: s.Literal) -> str:
        if expr.kind == "float":
            return literal(expr) + ("f" if self.real == "float" else "")
        if expr.kind == "bool":
            return "1" if expr.value else "0"
        return literal(expr)

    def wide(self, expr: s.Expr, type: Numeric) -> str:
        """Return an operand, widened to a vector where the operation is one."""
        text = self.expr(expr)
        if type.n > 1 and isinstance(expr.type, Numeric) and expr.type.n == 1:
            return f"({self.type(type)})({text})"
        return text

    def operation(self, op: str, a: s.Expr, b: s.Expr) -> str:
        assert isinstance(a.type, Numeric)
        assert isinstance(b.type, Numeric)
        left, right = self.expr(a), self.expr(b)
        if op == "^^":
            return f"({left} != {right})"
        if op in ("/", "%") and a.type.base in ("int", "uint"):
            return self.division(op, a, b)
        if op in ("<<", ">>") and a.type.base != b.type.base:
            right = self.converted(right, b.type, Numeric(a.type.base, b.type.n))
        return f"({left} {op} {right})"

    def division(self, op: str, a: s.Expr, b: s.Expr) -> str:
        """Integer division never traps: x / 0 and x % 0 are 0, and % has the sign of its left side."""
        assert isinstance(a.type, Numeric)
        assert isinstance(b.type, Numeric)
        type = Numeric(a.type.base, max(a.type.n, b.type.n))
        left, right = self.wide(a, type), self.wide(b, type)
        if divides_plainly(b):
            return f"({left} {op} {right})"
        T = self.type(type)
        divide = f"ng_divide_{T}"
        text = prelude.DIVIDE if type.base == "int" else prelude.DIVIDE_UNSIGNED
        self.helper(divide, text.format(T=T, name=divide))
        if op == "/":
            return f"{divide}({left}, {right})"
        name = f"ng_remainder_{T}"
        self.helper(name, prelude.REMAINDER.format(T=T, name=name, divide=divide))
        return f"{name}({left}, {right})"

    def converted(self, text: str, given: Numeric, wanted: Numeric) -> str:
        """Convert a value between bases; both have the same length."""
        if given.base == wanted.base:
            return text
        if wanted.n == 1:
            if wanted.base == "bool":
                return f"({text} != 0)"
            return f"(({self.type(wanted)})({text}))"
        if wanted.base == "float":
            return f"TO_REAL{wanted.n}({text})"
        return f"convert_{self.type(wanted)}({text})"

    # Calls

    def call(self, call: s.Call) -> str:
        if call.target == "field":
            return self.field_call(call)
        if call.target == "function":
            return self.own_call(call)
        if call.target == "builtin":
            return self.builtin(call)
        if isinstance(call.type, Numeric):
            return self.vector(call, call.type)
        if isinstance(call.type, Matrix):
            return self.matrix(call, call.type)
        return f"(({self.type(call.type)}){{{', '.join(map(self.expr, call.args))}}})"

    def vector(self, call: s.Call, type: Numeric) -> str:
        """A scalar or vector constructor: convert, cut what is too long, put together."""
        parts, missing = [], type.n
        for arg in call.args:
            given = arg.type
            assert isinstance(given, Numeric)
            text = self.expr(arg)
            if given.n > missing:
                text = f"{text}.{'xyzw'[:missing]}"
                given = Numeric(given.base, missing)
            missing -= given.n
            parts.append(self.converted(text, given, Numeric(type.base, given.n)))
        if len(parts) == 1 and missing == 0:
            return parts[0]
        return f"(({self.type(type)})({', '.join(parts)}))"

    def matrix(self, call: s.Call, type: Matrix) -> str:
        n = type.n
        columns = [self.expr(arg) for arg in call.args]
        if len(columns) == 1:
            name = self.helper(
                f"ng_diagonal{n}",
                f"static {self.type(type)} ng_diagonal{n}(real d) {{ return ({self.type(type)}){{{{"
                + ", ".join(f"(real{n})({', '.join('d' if i == j else '0' for j in range(n))})" for i in range(n))
                + "}}; }",
            )
            return f"{name}({columns[0]})"
        return f"(({self.type(type)}){{{{{', '.join(columns)}}}}})"

    def builtin(self, call: s.Call) -> str:
        name = call.name
        own: Callable[[s.Call], str] | None = getattr(self, f"builtin_{name.lower()}", None)
        if own is not None:
            return own(call)
        if name in _COMPARE:
            return self.comparison(call)
        if name in prelude.SAME:
            return f"{prelude.SAME[name]}({', '.join(map(self.expr, call.args))})"
        if name in prelude.INLINE:
            return prelude.INLINE[name].format(self.expr(call.args[0]))
        return self.helped(call)

    def helped(self, call: s.Call) -> str:
        """Call a helper that is printed for the types of this call."""
        first = call.args[0].type
        assert isinstance(call.type, Numeric)
        assert isinstance(first, Numeric)
        T, A = self.type(call.type), self.type(first)
        name = f"ng_{call.name}_{A if call.name in ('length', 'distance') else T}"
        text = prelude.HELPERS[call.name].format(T=T, A=A, name=name, dot="dot(v, m)")
        self.helper(name, text)
        last_is_scalar = call.name == "refract"
        count = len(call.args)
        args = [
            self.expr(arg) if call.type.n == 1 or (last_is_scalar and i == count - 1) else self.wide(arg, call.type)
            for i, arg in enumerate(call.args)
        ]
        return f"{name}({', '.join(args)})"

    def builtin_atan(self, call: s.Call) -> str:
        return f"{'atan2' if len(call.args) == 2 else 'atan'}({', '.join(map(self.expr, call.args))})"

    def builtin_abs(self, call: s.Call) -> str:
        assert isinstance(call.type, Numeric)
        return f"fabs({self.expr(call.args[0])})" if call.type.base == "float" else self.helped(call)

    def builtin_mix(self, call: s.Call) -> str:
        assert isinstance(call.type, Numeric)
        assert isinstance(call.args[2].type, Numeric)
        if call.args[2].type.base != "bool":
            return self.helped(call)
        x, y, choice = map(self.expr, call.args)
        if call.type.n > 1:
            choice = f"MASK{call.type.n}({choice})"
        return f"({choice} ? {y} : {x})"

    def builtin_normalize(self, call: s.Call) -> str:
        assert isinstance(call.type, Numeric)
        n = call.type.n
        if n == 1:
            text = prelude.HELPERS["sign"].format(T="real", name="ng_sign_real")
            return f"{self.helper('ng_sign_real', text)}({self.expr(call.args[0])})"
        largest = "fabs(v.x)"
        for letter in "yzw"[: n - 1]:
            largest = f"fmax({largest}, fabs(v.{letter}))"
        text = prelude.NORMALIZE.format(T=f"real{n}", name=f"ng_normalize{n}", largest=largest)
        return f"{self.helper(f'ng_normalize{n}', text)}({self.expr(call.args[0])})"

    def bools(self, text: str, type: Type) -> str:
        """Return the result of a comparison of floats as bools of the language."""
        assert isinstance(type, Numeric)
        return text if type.n == 1 else f"BOOLS{type.n}({text})"

    def comparison(self, call: s.Call) -> str:
        text = f"({self.expr(call.args[0])} {_COMPARE[call.name]} {self.expr(call.args[1])})"
        first = call.args[0].type
        assert isinstance(first, Numeric)
        return self.bools(text, call.type) if first.base == "float" else text

    def builtin_isnan(self, call: s.Call) -> str:
        return self.bools(f"{call.name}({self.expr(call.args[0])})", call.type)

    builtin_isinf = builtin_isnan

    def builtin_any(self, call: s.Call) -> str:
        return f"{call.name}({self.expr(call.args[0])})"

    builtin_all = builtin_any

    def builtin_not(self, call: s.Call) -> str:
        return f"(~{self.expr(call.args[0])})"

    def builtin_floatbitstouint(self, call: s.Call) -> str:
        type = call.args[0].type
        assert isinstance(type, Numeric)
        n = "" if type.n == 1 else str(type.n)
        return f"as_uint{n}(convert_float{n}({self.expr(call.args[0])}))"

    def builtin_uintbitstofloat(self, call: s.Call) -> str:
        type = call.args[0].type
        assert isinstance(type, Numeric)
        n = "" if type.n == 1 else str(type.n)
        return f"convert_{self.real}{n}(as_float{n}({self.expr(call.args[0])}))"

    def builtin_transform(self, call: s.Call) -> str:
        matrix = call.args[0].type
        assert isinstance(matrix, Matrix)
        self.type(matrix)
        total = " + ".join(f"m.c[{i}] * v.{'xyzw'[i]}" for i in range(matrix.n))
        name = self.helper(f"ng_transform{matrix.n}", prelude.TRANSFORM.format(n=matrix.n, sum=total))
        return f"{name}({', '.join(map(self.expr, call.args))})"
