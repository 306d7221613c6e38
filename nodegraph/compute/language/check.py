"""Check a whole kernel: declarations, call graph, entry; the result is a ``Module``."""

from __future__ import annotations

from nodegraph.shaders import Source

from . import builtins
from . import syntax as s
from .check_expressions import a
from .check_statements import StatementChecker, is_plain
from .module import FieldDecl, Module, OutputDecl, Uniform
from .names import mangle
from .preprocess import Prepared
from .types import FLOAT, INT, UINT, Array, Field, Matrix, Numeric, Struct, Type, Void, vector

ENTRIES = {"pixel": vector(2, "int"), "voxel": vector(3, "int")}
RESULTS = (FLOAT, vector(2), vector(4), INT, UINT)
MAX_OUTPUTS = 8
MAX_CALLS = 48
MAX_NUMBERS = 65536


def check(tree: s.Tree, source: Source, prepared: Prepared) -> Module:
    """Return the checked kernel. Raises ShaderError with file, line and excerpt."""
    return _Checker(source, prepared).module(tree)


class _Checker(StatementChecker):
    def __init__(self, source: Source, prepared: Prepared) -> None:
        super().__init__(source)
        self.prepared = prepared

    def module(self, tree: s.Tree) -> Module:
        for decl in tree.order:
            if isinstance(decl, s.StructDecl):
                self.declare_struct(decl)
            else:
                self.declare_global(decl)
        for function in tree.functions:
            self.declare_function(function)
        for function in tree.functions:
            self.body(function)
        self.refuse_recursion()
        entry = self.entry(tree)
        reached = self.reached(entry)
        used = {name for function in reached.values() for name in function.reads}
        consts = [decl for decl in tree.globals if decl.word == "const"]
        uniforms = [decl for decl in tree.globals if decl.word == "uniform"]
        fields = [decl for decl in tree.globals if decl.word == "field"]
        program = s.Program(
            entry,
            list(self.structs.values()),
            consts,
            [symbol for symbol in map(_symbol, uniforms) if symbol.name in used],
            [symbol for symbol in map(_symbol, fields) if symbol.name in used],
            reached,
            self.source.places,
        )
        return Module(
            entry=entry.name,
            uniforms=tuple(self.uniform(decl, decl.name in used) for decl in uniforms),
            fields=tuple(self.field_decl(decl, decl.name in used) for decl in fields),
            outputs=self.outputs(entry),
            doc=self.prepared.doc,
            absent=self.prepared.absent - {decl.name for decl in tree.globals},
            files=self.source.files,
            program=program,
        )

    # Declarations

    def new(self, name: str, line: int, callable: bool = True) -> None:
        """Refuse a global name that is taken. Values may bear the name of a built-in (``uniform float step``)."""
        if callable and name in builtins.NAMES:
            raise self.fail(line, f"{name} is a built-in function: choose another name")
        if name in ENTRIES and name not in self.functions:
            raise self.fail(line, f"{name} is the name of an entry function: choose another name")
        if name in self.structs or name in self.globals:
            raise self.fail(line, f"{name} is declared twice")

    def declare_struct(self, decl: s.StructDecl) -> None:
        self.new(decl.name, decl.line)
        members: list[tuple[str, Type]] = []
        for written, name, line in decl.members:
            type = self.resolve(written)
            if not is_plain(type):
                raise self.fail(line, f"a member cannot be {a(type)}")
            if name in dict(members):
                raise self.fail(line, f"{decl.name} has two members called {name}")
            members.append((name, type))
        if not members:
            raise self.fail(decl.line, f"{decl.name} has no members")
        self.structs[decl.name] = Struct(decl.name, tuple(members))
        if numbers(self.structs[decl.name]) > MAX_NUMBERS:
            raise self.fail(decl.line, f"{decl.name} holds more than {MAX_NUMBERS} numbers")

    def declare_global(self, decl: s.GlobalDecl) -> None:
        self.new(decl.name, decl.line, callable=False)
        if decl.value is not None:
            self.value(decl.value)
        type = self.resolve(decl.written, decl.value)
        if decl.word == "field" and decl.value is not None:
            raise self.fail(decl.line, f"{decl.name} is a field and has no default")
        if decl.word != "field" and (isinstance(type, Field | Void) or (decl.word == "uniform" and not is_plain(type))):
            raise self.fail(decl.line, f"a {decl.word} cannot be {a(type)}")
        if decl.word == "uniform" and numbers(type) > MAX_NUMBERS:
            raise self.fail(decl.line, f"{decl.name} holds more than {MAX_NUMBERS} numbers: make it a field")
        if decl.value is not None and decl.value.type != type:
            self.mismatch(decl.value, type, decl.name)
        if decl.word == "const":
            if decl.value is None:
                raise self.fail(decl.line, f"the const {decl.name} needs a value")
            if isinstance(type, Array) and not isinstance(decl.value, s.ArrayLiteral):
                raise self.fail(decl.line, f"write the elements of {decl.name} as {type}(...)")
            self.refuse_inconstant(decl.value)
        if decl.word == "uniform" and decl.value is not None and decl.value.constant is None:
            raise self.fail(decl.line, "the default of a uniform is a constant number, bool or vector")
        prefix = {"const": "k", "uniform": "u", "field": "f"}[decl.word]
        symbol = s.Symbol(decl.word, decl.name, type, decl.line, mangle(prefix, decl.name))
        if decl.word == "const" and decl.value is not None:
            symbol.constant = decl.value.constant
        decl.symbol = symbol
        self.globals[decl.name] = symbol

    def refuse_inconstant(self, expr: s.Expr) -> None:
        """A global const depends on constants only; the elements of an array of them have known values."""
        if isinstance(expr, s.ArrayLiteral):
            for arg in expr.args:
                if arg.constant is None:
                    raise self.fail(arg.line, "an array of constants is made of numbers and vectors of numbers")
        elif isinstance(expr, s.Name):
            if expr.symbol is None or expr.symbol.kind != "const":
                raise self.fail(expr.line, f"{expr.name} is no constant, and this const is global")
        elif isinstance(expr, s.Call) and expr.target in ("function", "field"):
            raise self.fail(expr.line, f"a global const cannot call {expr.name}: write the value")
        for part in children(expr):
            self.refuse_inconstant(part)

    def declare_function(self, function: s.Function) -> None:
        name, line = function.name, function.line
        if name in self.functions:
            raise self.fail(line, f"{name} is defined twice: functions are not overloaded, choose another name")
        self.functions[name] = function
        self.new(name, line)
        type = self.resolve(function.written)
        if isinstance(type, Void):
            if name == "main":
                raise self.fail(line, "the entry is 'vec4 pixel(ivec2 at)' or 'vec4 voxel(ivec3 at)', not main")
            raise self.fail(line, f"{name} returns nothing, but a function has no other effect: return a value")
        if isinstance(type, Field):
            raise self.fail(line, f"{name} cannot return a field")
        function.type = type
        seen: set[str] = set()
        for parameter in function.parameters:
            own = self.resolve(parameter.written)
            if isinstance(own, Void) or (isinstance(own, Field) and own.count):
                raise self.fail(parameter.line, f"a parameter cannot be {a(own)}: pass one field")
            if parameter.name in seen:
                raise self.fail(parameter.line, f"{name} has two parameters called {parameter.name}")
            seen.add(parameter.name)
            writable = not isinstance(own, Field)
            parameter.symbol = s.Symbol("parameter", parameter.name, own, parameter.line, "", writable=writable)

    # The whole

    def refuse_recursion(self) -> None:
        """Refuse cycles and very long chains of calls."""
        height: dict[str, int] = {}
        for start in self.functions:
            path: list[str] = []
            self.visit(start, path, height)

    def visit(self, name: str, path: list[str], height: dict[str, int]) -> int:
        if name in height:
            return height[name]
        path.append(name)
        tallest = 0
        for callee, line in self.functions[name].calls.items():
            if callee in path:
                chain = " -> ".join([*path[path.index(callee) :], callee])
                raise self.fail(line, f"{chain} is a recursion, which is not in the language: write a loop")
            if len(path) >= MAX_CALLS:
                raise self.fail(line, f"functions call each other more than {MAX_CALLS} deep")
            tallest = max(tallest, self.visit(callee, path, height))
        path.pop()
        height[name] = tallest + 1
        if height[name] > MAX_CALLS:
            raise self.fail(self.functions[name].line, f"functions call each other more than {MAX_CALLS} deep")
        return tallest + 1

    def entry(self, tree: s.Tree) -> s.Function:
        found = [function for function in tree.functions if function.name in ENTRIES]
        if len(found) != 1:
            line = found[1].line if found else 1
            count = "two entries" if found else "no entry"
            raise self.fail(
                line, f"a kernel has one entry, 'vec4 pixel(ivec2 at)' or 'vec4 voxel(ivec3 at)'; here are {count}"
            )
        entry = found[0]
        given = [parameter.symbol.type for parameter in entry.parameters if parameter.symbol]
        if given != [ENTRIES[entry.name]]:
            raise self.fail(entry.line, f"{entry.name} takes one {ENTRIES[entry.name]}, its position")
        for function in tree.functions:
            if entry.name in function.calls:
                raise self.fail(function.calls[entry.name], f"{entry.name} is the entry and cannot be called")
        return entry

    def outputs(self, entry: s.Function) -> tuple[OutputDecl, ...]:
        type = entry.type
        if isinstance(type, Struct):
            if len(type.members) > MAX_OUTPUTS:
                raise self.fail(entry.line, f"{type} has more than {MAX_OUTPUTS} members, and each is one output")
            parts = type.members
        else:
            parts = (("", type),)
        found = []
        for name, part in parts:
            if part not in RESULTS or not isinstance(part, Numeric):
                cure = ": use vec4" if part == vector(3) else ""
                raise self.fail(entry.line, f"an output is a float, vec2, vec4, int or uint, not {a(part)}{cure}")
            found.append(OutputDecl(name, part))
        return tuple(found)

    def reached(self, entry: s.Function) -> dict[str, s.Function]:
        """Return the functions that the entry needs."""
        reached: dict[str, s.Function] = {}
        waiting = [entry.name]
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached[name] = self.functions[name]
                waiting += reached[name].calls
        return reached

    def doc(self, line: int) -> str:
        return self.prepared.comments.get(line, "")

    def uniform(self, decl: s.GlobalDecl, used: bool) -> Uniform:
        type = _symbol(decl).type
        element = type.element if isinstance(type, Array) else type
        assert isinstance(element, Numeric | Matrix | Struct)
        default = decl.value.constant if decl.value is not None else None
        count = type.count if isinstance(type, Array) else 0
        return Uniform(decl.name, element, count, default, self.doc(decl.line), decl.line, used)

    def field_decl(self, decl: s.GlobalDecl, used: bool) -> FieldDecl:
        type = _symbol(decl).type
        assert isinstance(type, Field)
        return FieldDecl(decl.name, type.kind, type.count, self.doc(decl.line), decl.line, used)


def _symbol(decl: s.GlobalDecl) -> s.Symbol:
    assert decl.symbol is not None
    return decl.symbol


def children(expr: s.Expr) -> list[s.Expr]:
    """Return the direct parts of an expression."""
    if isinstance(expr, s.Call | s.ArrayLiteral):
        return expr.args
    if isinstance(expr, s.Binary):
        return [expr.left, expr.right]
    if isinstance(expr, s.Unary):
        return [expr.operand]
    if isinstance(expr, s.Ternary):
        return [expr.condition, expr.yes, expr.no]
    if isinstance(expr, s.Index):
        return [expr.base, expr.index]
    return [expr.base] if isinstance(expr, s.Member) else []


def numbers(type: Type) -> int:
    """Return how many scalars a value holds."""
    if isinstance(type, Numeric):
        return type.n
    if isinstance(type, Matrix):
        return type.n * type.n
    if isinstance(type, Array):
        return type.count * numbers(type.element)
    if isinstance(type, Struct):
        return sum(numbers(part) for _, part in type.members)
    return 0
