"""Give every expression its type, and refuse what has none."""

from __future__ import annotations

from typing import NoReturn

from nodegraph.errors import ShaderError, near_miss
from nodegraph.shaders import Source

from . import builtins, fold
from . import syntax as s
from .types import BOOL, INT, NAMED, UINT, Array, Field, Matrix, Numeric, Struct, Type, Void, vector

_SWIZZLES = ("xyzw", "rgba", "stpq")
_BITS = ("&", "|", "^", "<<", ">>")


class ExpressionChecker:
    """Types expressions; subclasses know declarations and statements."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.structs: dict[str, Struct] = {}
        self.globals: dict[str, s.Symbol] = {}
        self.functions: dict[str, s.Function] = {}
        self.scopes: list[dict[str, s.Symbol]] = []
        self.function: s.Function | None = None

    def fail(self, line: int, message: str) -> ShaderError:
        return self.source.error(line, message)

    def find(self, name: str) -> s.Symbol | None:
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        return self.globals.get(name)

    # Values

    def value(self, expr: s.Expr) -> Type:
        """Type an expression that must be a value, not a field."""
        type = self.check(expr)
        if isinstance(type, Field):
            raise self.fail(
                expr.line, "a field is no value: read it by sample or fetch, or pass it as a field parameter"
            )
        return type

    def check(self, expr: s.Expr) -> Type:
        """Fill in ``expr.type`` (and ``expr.constant``) and return the type."""
        expr.type = getattr(self, f"check_{type(expr).__name__.lower()}")(expr)
        return expr.type

    def numeric(self, expr: s.Expr) -> Numeric:
        type = self.value(expr)
        if isinstance(type, Matrix):
            raise self.fail(expr.line, "matrices have no operators here: write transform(m, v)")
        if not isinstance(type, Numeric):
            raise self.fail(expr.line, f"{a(type)} has no operators")
        return type

    def check_literal(self, expr: s.Literal) -> Type:
        expr.constant = expr.value
        return Numeric(expr.kind)

    def check_name(self, expr: s.Name) -> Type:
        symbol = self.find(expr.name)
        if symbol is None:
            if expr.name in self.functions or expr.name in builtins.NAMES:
                raise self.fail(expr.line, f"{expr.name} is a function: call it as {expr.name}(...)")
            known = {name for scope in self.scopes for name in scope} | set(self.globals)
            raise self.fail(expr.line, f"{expr.name} is not declared{near_miss(expr.name, sorted(known))}")
        expr.symbol = symbol
        expr.constant = symbol.constant
        if self.function is not None and symbol.kind in ("uniform", "field", "const"):
            self.function.reads[symbol.name] = symbol
        return symbol.type

    def check_unary(self, expr: s.Unary) -> Type:
        type = self.numeric(expr.operand)
        if expr.op == "!":
            if type != BOOL:
                cure = "write not(...)" if type.base == "bool" else "compare with == or !="
                raise self.fail(expr.line, f"! takes a bool, not {a(type)}: {cure}")
        elif expr.op == "~":
            if type.base not in ("int", "uint"):
                raise self.fail(expr.line, f"~ takes int or uint, not {a(type)}")
        elif type.base == "bool":
            raise self.fail(expr.line, f"{expr.op} takes a number, not {a(type)}")
        if expr.operand.constant is not None:
            expr.constant = fold.unary(expr.op, expr.operand.constant, type)
        return type

    def check_binary(self, expr: s.Binary) -> Type:
        left, right = self.numeric(expr.left), self.numeric(expr.right)
        result = self.operation(expr.line, expr.op, left, right, expr.left, expr.right)
        if expr.left.constant is not None and expr.right.constant is not None:
            expr.constant = fold.binary(expr.op, expr.left.constant, expr.right.constant, left)
        return result

    def operation(self, line: int, op: str, left: Numeric, right: Numeric, a_: s.Expr, b_: s.Expr) -> Numeric:
        """Return the type of ``left op right``, or refuse it."""
        if op in ("&&", "||", "^^"):
            if left != BOOL or right != BOOL:
                raise self.fail(line, f"{op} takes two bools, not {a(left)} and {a(right)}")
            return BOOL
        if op in ("<<", ">>"):
            if left.base not in ("int", "uint") or right.base not in ("int", "uint") or right.n not in (1, left.n):
                raise self.fail(line, f"{op} takes int or uint, not {a(left)} and {a(right)}")
            return left
        if left.base != right.base:
            raise self.fail(line, f"{op} between {a(left)} and {a(right)}: {self.convert(left, right, a_, b_)}")
        if op in ("==", "!=", "<", ">", "<=", ">="):
            if left.n != 1 or right.n != 1:
                name = {"==": "all(equal(a, b))", "!=": "any(notEqual(a, b))", "<": "lessThan(a, b)"}
                cure = name.get(op, {">": "greaterThan(a, b)", "<=": "lessThanEqual(a, b)"}.get(op))
                raise self.fail(line, f"{op} compares scalars: write {cure or 'greaterThanEqual(a, b)'}")
            if left == BOOL and op not in ("==", "!="):
                raise self.fail(line, f"{op} does not order bools")
            return BOOL
        if left.base == "bool":
            raise self.fail(line, f"{op} takes numbers, not bools")
        if op in (*_BITS, "%") and left.base == "float":
            cure = "write mod(a, b)" if op == "%" else "convert to int or uint first"
            raise self.fail(line, f"{op} takes int or uint: {cure}")
        if left.n != right.n and 1 not in (left.n, right.n):
            raise self.fail(line, f"{op} between {a(left)} and {a(right)}: the lengths differ")
        return left if left.n >= right.n else right

    def convert(self, left: Numeric, right: Numeric, a_: s.Expr, b_: s.Expr) -> str:
        """Say how two types are brought together."""
        for expr, type, other in ((b_, right, left), (a_, left, right)):
            if isinstance(expr, s.Literal) and type.base == "int" and other.base in ("float", "uint"):
                return f"write {expr.value}{'.0' if other.base == 'float' else 'u'}"
        if {left.base, right.base} == {"float", "int"} or {left.base, right.base} == {"float", "uint"}:
            other = left if left.base != "float" else right
            return f"numbers are not converted silently, write {Numeric('float', other.n)}(...)"
        return f"numbers are not converted silently, write {Numeric(left.base, right.n)}(...)"

    def condition(self, expr: s.Expr, what: str) -> None:
        type = self.value(expr)
        if type != BOOL:
            bools = isinstance(type, Numeric) and type.base == "bool"
            raise self.fail(
                expr.line,
                f"{what} takes a bool, not {a(type)}: {'write any(...) or all(...)' if bools else 'compare it'}",
            )

    def check_ternary(self, expr: s.Ternary) -> Type:
        self.condition(expr.condition, "?:")
        yes, no = self.value(expr.yes), self.value(expr.no)
        if yes != no:
            cure = ""
            if isinstance(yes, Numeric) and isinstance(no, Numeric) and yes.base != no.base:
                cure = f": {self.convert(yes, no, expr.yes, expr.no)}"
            raise self.fail(expr.line, f"?: gives {a(yes)} or {a(no)}{cure}")
        if expr.condition.constant is not None:
            expr.constant = (expr.yes if expr.condition.constant else expr.no).constant
        return yes

    # Parts

    def check_member(self, expr: s.Member) -> Type:
        base = self.value(expr.base)
        if isinstance(base, Struct):
            type = base.member(expr.name)
            if type is None:
                hint = near_miss(expr.name, [name for name, _ in base.members])
                raise self.fail(expr.line, f"{base} has no member {expr.name}{hint}")
            return type
        if not isinstance(base, Numeric):
            raise self.fail(expr.line, f"{a(base)} has no member {expr.name}")
        if base.n == 1:
            raise self.fail(expr.line, f"{a(base)} has no components: .{expr.name} is for vectors")
        if base.base == "bool":
            raise self.fail(expr.line, "a bool vector is read by any(...) and all(...) only")
        for letters in _SWIZZLES:
            if all(letter in letters for letter in expr.name):
                break
        else:
            raise self.fail(expr.line, f".{expr.name} is no swizzle: use letters of xyzw, rgba or stpq")
        where = [letters.index(letter) for letter in expr.name]
        if len(where) > 4 or max(where) >= base.n:
            raise self.fail(expr.line, f"{a(base)} has no .{expr.name}")
        expr.swizzle = "".join("xyzw"[i] for i in where)
        if isinstance(expr.base.constant, tuple) and len(where) == 1:
            expr.constant = expr.base.constant[where[0]]
        return Numeric(base.base, len(where))

    def check_index(self, expr: s.Index) -> Type:
        base = self.check(expr.base)
        index = self.value(expr.index)
        if index != INT:
            cure = ": write int(...)" if index in (UINT, Numeric("float")) else ""
            raise self.fail(expr.line, f"an index is an int, not {a(index)}{cure}")
        if isinstance(base, Array) or (isinstance(base, Field) and base.count):
            count = base.count
            element: Type = base.element if isinstance(base, Array) else Field(base.kind)
        elif isinstance(base, Numeric) and base.n > 1 and base.base != "bool":
            count, element = base.n, Numeric(base.base)
        elif isinstance(base, Matrix):
            count, element = base.n, vector(base.n)
        else:
            raise self.fail(expr.line, f"{a(base)} cannot be indexed")
        at = expr.index.constant
        if isinstance(at, int) and not 0 <= at < count:
            raise self.fail(expr.line, f"the index {at} is outside 0..{count - 1}")
        return element

    # Calls

    def check_call(self, expr: s.Call) -> Type:
        if expr.name in builtins.ACCESSORS:
            expr.target = "field"
            return self.accessor(expr)
        if expr.name in builtins.SIGNATURES:
            expr.target = "builtin"
            return self.builtin(expr)
        if expr.name in self.functions:
            expr.target = "function"
            return self.own_call(expr)
        expr.target = "constructor"
        if expr.name in self.structs:
            return self.struct_constructor(expr, self.structs[expr.name])
        named = NAMED.get(expr.name)
        if isinstance(named, Matrix):
            return self.matrix_constructor(expr, named)
        if isinstance(named, Numeric):
            return self.numeric_constructor(expr, named)
        if named is not None:
            raise self.fail(expr.line, f"{expr.name} cannot be constructed")
        if self.find(expr.name) is not None:
            raise self.fail(expr.line, f"{expr.name} is a variable here, not a function")
        hint = near_miss(expr.name, sorted(builtins.NAMES | set(self.functions) | set(self.structs)))
        raise self.fail(expr.line, f"there is no function {expr.name}{hint}")

    def builtin(self, expr: s.Call) -> Type:
        types = [self.value(arg) for arg in expr.args]
        result = builtins.resolve(expr.name, types)
        if result is None:
            cure = ""
            literal = next((arg for arg in expr.args if isinstance(arg, s.Literal) and arg.kind == "int"), None)
            floats = any(isinstance(type, Numeric) and type.base == "float" for type in types)
            if literal is not None and (floats or "I" not in "".join(builtins.SIGNATURES[expr.name])):
                cure = f": write {literal.value}.0"
            raise self.fail(
                expr.line,
                f"{expr.name}({', '.join(map(str, types))}) does not exist, "
                f"it takes {builtins.describe(expr.name)}{cure}",
            )
        return result

    def field(self, expr: s.Expr) -> Field:
        """Type an argument that must be one field."""
        type = self.check(expr)
        if not isinstance(type, Field):
            raise self.fail(expr.line, f"a field is needed here, not {a(type)}")
        if type.count:
            raise self.fail(expr.line, "choose one field of the array by an index")
        return type

    def accessor(self, expr: s.Call) -> Type:
        kinds, position, result = builtins.ACCESSORS[expr.name]
        form = f"{expr.name}({kinds[0]}{f', {position}' if position else ''})"
        if len(expr.args) != (2 if position else 1):
            raise self.fail(expr.line, f"write {form}")
        kind = self.field(expr.args[0]).kind
        if kind not in kinds:
            fitting = [name for name, (other, _, _) in builtins.ACCESSORS.items() if kind in other]
            raise self.fail(expr.line, f"{expr.name} does not read {a(Field(kind))}: use {' or '.join(fitting)}")
        if position:
            type = self.value(expr.args[1])
            if type != position:
                raise self.fail(expr.line, f"the position of {form} is {a(position)}, not {a(type)}")
        return result

    def own_call(self, expr: s.Call) -> Type:
        function = self.functions[expr.name]
        if len(expr.args) != len(function.parameters):
            raise self.fail(
                expr.line, f"{expr.name} takes {len(function.parameters)} arguments, and {len(expr.args)} are given"
            )
        for arg, parameter in zip(expr.args, function.parameters, strict=True):
            wanted = parameter.symbol.type if parameter.symbol else INT
            given = self.field(arg) if isinstance(wanted, Field) else self.value(arg)
            if given != wanted:
                self.mismatch(arg, wanted, f"{parameter.name} of {expr.name}")
        if self.function is not None:
            self.function.calls.setdefault(expr.name, expr.line)
        return function.type

    def mismatch(self, expr: s.Expr, wanted: Type, what: str) -> NoReturn:
        """Raise the error for a value of the wrong type."""
        cure = ""
        if isinstance(wanted, Numeric) and isinstance(expr.type, Numeric):
            if isinstance(expr, s.Literal) and expr.kind == "int" and wanted.n == 1 and wanted.base != "bool":
                cure = f": write {expr.value}{'.0' if wanted.base == 'float' else 'u'}"
            else:
                cure = f": write {wanted}(...)"
        raise self.fail(expr.line, f"{what} is {a(wanted)}, and this is {a(expr.type)}{cure}")

    def struct_constructor(self, expr: s.Call, type: Struct) -> Type:
        if len(expr.args) != len(type.members):
            raise self.fail(expr.line, f"{type} has {len(type.members)} members, and {len(expr.args)} values are given")
        for arg, (name, wanted) in zip(expr.args, type.members, strict=True):
            if self.value(arg) != wanted:
                self.mismatch(arg, wanted, f"{name} of {type}")
        return type

    def matrix_constructor(self, expr: s.Call, type: Matrix) -> Type:
        given = [self.value(arg) for arg in expr.args]
        if given != [Numeric("float")] and given != [vector(type.n)] * type.n:
            raise self.fail(expr.line, f"write {type}(1.0) for the identity, or {type} of {type.n} vec{type.n} columns")
        return type

    def numeric_constructor(self, expr: s.Call, type: Numeric) -> Type:
        if type.base == "bool" and type.n > 1:
            raise self.fail(expr.line, f"{type} is made by comparison functions only, such as lessThan(a, b)")
        count = 0
        for position, arg in enumerate(expr.args):
            given = self.value(arg)
            if not isinstance(given, Numeric) or (given.base == "bool" and given.n > 1):
                raise self.fail(arg.line, f"{type} cannot be made from {a(given)}")
            if position and count >= type.n:
                raise self.fail(arg.line, f"{type} is complete before this value")
            count += given.n
        if len(expr.args) == 1 and count == 1:
            count = type.n
        if count < type.n:
            raise self.fail(expr.line, f"{type} needs {type.n} numbers, and {count} are given")
        expr.constant = fold.construct(type, expr.args)
        return type

    def check_arrayliteral(self, expr: s.ArrayLiteral) -> Type:
        element: Type = self.structs.get(expr.element) or NAMED[expr.element]
        if not isinstance(element, Numeric | Matrix | Struct) or _is_bools(element):
            raise self.fail(expr.line, f"there are no arrays of {element}")
        count = len(expr.args) if expr.count is None else self.size(expr.count)
        if not expr.args or count != len(expr.args):
            raise self.fail(expr.line, f"{count} values are needed, and {len(expr.args)} are given")
        for arg in expr.args:
            if self.value(arg) != element:
                self.mismatch(arg, element, "an element of this array")
        return Array(element, count)

    def size(self, expr: s.Expr) -> int:
        """Return the value of the length of an array."""
        type = self.value(expr)
        if type not in (INT, UINT) or not isinstance(expr.constant, int):
            raise self.fail(expr.line, "the length of an array is a constant int: a number, a define or a const")
        if not 1 <= expr.constant <= 65536:
            raise self.fail(expr.line, f"an array of {expr.constant} elements is outside 1..65536")
        return expr.constant

    def resolve(self, written: s.TypeName, value: s.Expr | None = None) -> Type:
        """Return the type that is written; ``value`` gives the length of ``float[]``."""
        base: Type | None = self.structs.get(written.name) or NAMED.get(written.name)
        if base is None:
            raise self.fail(written.line, f"{written.name!r} is no type: a struct is declared before it is used")
        if written.count is None and not written.unsized:
            return base
        if written.unsized:
            if not isinstance(value, s.ArrayLiteral):
                raise self.fail(written.line, "the length of this array is missing")
            count = len(value.args)
        else:
            assert written.count is not None
            count = self.size(written.count)
        if isinstance(base, Field):
            return Field(base.kind, count)
        if isinstance(base, Void) or not isinstance(base, Numeric | Matrix | Struct) or _is_bools(base):
            raise self.fail(written.line, f"there are no arrays of {base}")
        return Array(base, count)


def _is_bools(type: Type) -> bool:
    return isinstance(type, Numeric) and type.base == "bool" and type.n > 1


def a(type: Type) -> str:
    """Return the type with its article."""
    return f"{'an' if str(type)[0] in 'aeio' else 'a'} {type}"
