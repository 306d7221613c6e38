"""What both printers share: statements, functions specialised for their fields, and line directives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from . import syntax as s
from .module import Module
from .names import mangle
from .storage_types import Storage
from .types import FIELD_AXES, Field, Numeric, Type

Storages = Mapping[str, Sequence[Storage]]


@dataclass(frozen=True)
class FieldRef:
    """One field as an operand: a fixed ``element`` of a declared field, or ``index``, the text of a run-time index."""

    number: int
    element: int
    index: str = ""

    @property
    def stem(self) -> str:
        """First part of the printed names that belong to this field; ``any`` chooses the element at run time."""
        return f"g{self.number}any" if self.index else f"g{self.number}e{self.element}"


@dataclass(frozen=True)
class Instance:
    """A function with its field parameters replaced by fields."""

    function: str
    fields: tuple[FieldRef, ...]


class Printer(ABC):
    """Prints one module; used once. Subclasses print types, expressions and accessors."""

    def __init__(self, module: Module, storages: Storages) -> None:
        self.module = module
        self.program = module.program
        self.fields = self.program.fields
        self.storages = {symbol.name: self.storages_of(symbol, storages) for symbol in self.fields}
        self.instances: dict[Instance, str] = {}
        self.waiting: list[Instance] = []
        self.accessors: dict[tuple[str, FieldRef], str] = {}
        self.helpers: dict[str, str] = {}
        self.bound: dict[str, FieldRef] = {}
        self.lines: list[tuple[int, str]] = []
        self.depth = 0

    @staticmethod
    def storages_of(symbol: s.Symbol, storages: Storages) -> tuple[Storage, ...]:
        """Return the storages of a field, one per element; ValueError is an error of the calling device."""
        assert isinstance(symbol.type, Field)
        found = tuple(storages.get(symbol.name, ()))
        if len(found) != max(symbol.type.count, 1):
            raise ValueError(
                f"{symbol.name}: {max(symbol.type.count, 1)} storages are needed, and {len(found)} are given"
            )
        return found

    # What the languages print differently

    @abstractmethod
    def type(self, type: Type) -> str:
        """Return the printed name of a type."""

    @abstractmethod
    def expr(self, expr: s.Expr) -> str:
        """Return the text of an expression, in parentheses where it needs them."""

    @abstractmethod
    def zero(self, type: Type) -> str:
        """Return the value of a variable that is declared without one."""

    @abstractmethod
    def target(self, expr: s.Expr) -> str:
        """Return the text of what is assigned to."""

    @abstractmethod
    def operation(self, op: str, a: s.Expr, b: s.Expr) -> str:
        """Return the text of a binary operation."""

    @abstractmethod
    def accessor(self, name: str, ref: FieldRef) -> str:
        """Return the text of an accessor function of a field."""

    #: Parameters and arguments that every function carries besides its own.
    context_parameters: tuple[str, ...] = ()
    context_arguments: tuple[str, ...] = ()
    #: Words before a function.
    function_prefix = ""

    def helper(self, name: str, text: str) -> str:
        """Ask for a helper function and return its name."""
        self.helpers.setdefault(name, text)
        return name

    # Fields

    def field(self, expr: s.Expr) -> FieldRef:
        """Return which field an argument stands for."""
        if isinstance(expr, s.Name) and expr.symbol is not None:
            if expr.symbol.kind == "parameter":
                return self.bound[expr.name]
            return FieldRef(self.fields.index(expr.symbol), 0)
        assert isinstance(expr, s.Index)
        whole = self.field(expr.base)
        if isinstance(expr.index.constant, int):
            return FieldRef(whole.number, expr.index.constant)
        return FieldRef(whole.number, 0, self.expr(expr.index))

    def field_call(self, call: s.Call) -> str:
        """Return the text of sample3(...), fetch3(...), size3(...) and the like."""
        ref = self.field(call.args[0])
        name = self.use_accessor(call.name, ref)
        index = [ref.index] if ref.index else []
        rest = [self.expr(arg) for arg in call.args[1:]]
        return f"{name}({', '.join([*self.context_arguments, *index, *rest])})"

    def use_accessor(self, name: str, ref: FieldRef) -> str:
        """Ask for an accessor and return its name."""
        key = FieldRef(ref.number, ref.element, "i" if ref.index else "")
        if (name, key) not in self.accessors:
            text = self.accessor(name, key)  # asks for those of the elements first, so that they stand before it
            self.accessors[name, key] = text
        return f"{key.stem}_{name}"

    def storage(self, ref: FieldRef) -> Storage:
        return self.storages[self.fields[ref.number].name][ref.element]

    def axes(self, ref: FieldRef) -> int:
        return FIELD_AXES[self.kind(ref)]

    def kind(self, ref: FieldRef) -> str:
        type = self.fields[ref.number].type
        assert isinstance(type, Field)
        return type.kind

    def count(self, ref: FieldRef) -> int:
        type = self.fields[ref.number].type
        assert isinstance(type, Field)
        return max(type.count, 1)

    # Functions

    def own_call(self, call: s.Call) -> str:
        function = self.program.functions[call.name]
        refs: list[FieldRef] = []
        values: list[str] = []
        for arg, parameter in zip(call.args, function.parameters, strict=True):
            if isinstance(_symbol(parameter).type, Field):
                ref = self.field(arg)
                refs.append(FieldRef(ref.number, ref.element, "i" if ref.index else ""))
                if ref.index:
                    values.append(ref.index)
            else:
                values.append(self.expr(arg))
        name = self.instance(Instance(call.name, tuple(refs)))
        return f"{name}({', '.join([*self.context_arguments, *values])})"

    def instance(self, instance: Instance) -> str:
        """Return the printed name of a function for these fields, and see to it that it is printed."""
        if instance not in self.instances:
            copies = sum(other.function == instance.function for other in self.instances)
            self.instances[instance] = mangle(f"n{copies or ''}", instance.function)
            self.waiting.append(instance)
        return self.instances[instance]

    def head(self, instance: Instance) -> str:
        """Return the head of a function, and bind its field parameters."""
        function = self.program.functions[instance.function]
        refs = iter(instance.fields)
        parts = list(self.context_parameters)
        self.bound = {}
        for parameter in function.parameters:
            symbol = _symbol(parameter)
            if not isinstance(symbol.type, Field):
                parts.append(f"{self.type(symbol.type)} {symbol.printed}")
                continue
            ref = next(refs)
            if ref.index:
                parts.append(f"int {symbol.printed}")
                ref = FieldRef(ref.number, ref.element, symbol.printed)
            self.bound[parameter.name] = ref
        name = self.instances[instance]
        return f"{self.function_prefix}{self.type(function.type)} {name}({', '.join(parts)})"

    def functions(self) -> tuple[list[str], list[tuple[int, str]]]:
        """Print every function that was asked for; return prototypes and (line, text) pairs."""
        prototypes = []
        while self.waiting:
            instance = self.waiting.pop(0)
            function = self.program.functions[instance.function]
            head = self.head(instance)
            prototypes.append(f"{head};")
            self.emit(function.line, f"{head} {{")
            self.indented(function.body.body)
            self.emit(0, "}")
        return prototypes, self.lines

    # Statements

    def emit(self, line: int, text: str) -> None:
        """Add a line of text that comes from ``line`` of the joined source (0: from nowhere)."""
        self.lines.append((line, "    " * self.depth + text))

    def indented(self, body: Sequence[s.Stmt]) -> None:
        self.depth += 1
        for stmt in body:
            self.statement(stmt)
        self.depth -= 1

    def statement(self, stmt: s.Stmt) -> None:
        getattr(self, f"print_{type(stmt).__name__.lower()}")(stmt)

    def inner(self, stmt: s.Stmt) -> None:
        """Print the body of an if or a loop, without its braces."""
        self.indented(stmt.body if isinstance(stmt, s.Block) else [stmt])

    def print_block(self, stmt: s.Block) -> None:
        self.emit(stmt.line, "{")
        self.indented(stmt.body)
        self.emit(0, "}")

    def print_declare(self, stmt: s.Declare) -> None:
        assert stmt.symbol is not None
        type = stmt.symbol.type
        value = self.zero(type) if stmt.value is None else self.expr(stmt.value)
        self.emit(stmt.line, f"{self.type(type)} {stmt.symbol.printed} = {value};")

    def assignment(self, stmt: s.Assign) -> str:
        value = self.expr(stmt.value) if stmt.op == "=" else self.operation(stmt.op[:-1], stmt.target, stmt.value)
        return f"{self.target(stmt.target)} = {value}"

    def print_assign(self, stmt: s.Assign) -> None:
        self.emit(stmt.line, f"{self.assignment(stmt)};")

    def print_if(self, stmt: s.If) -> None:
        self.emit(stmt.line, f"if ({bare(self.expr(stmt.condition))}) {{")
        self.inner(stmt.yes)
        if stmt.no is not None:
            self.emit(0, "} else {")
            self.inner(stmt.no)
        self.emit(0, "}")

    def print_for(self, stmt: s.For) -> None:
        self.emit(stmt.line, "{")  # the declarations of its head may have several types: they stand before it
        self.depth += 1
        for part in stmt.start:
            self.statement(part)
        condition = "" if stmt.condition is None else bare(self.expr(stmt.condition))
        step = ", ".join(self.assignment(part) for part in stmt.step if isinstance(part, s.Assign))
        self.emit(stmt.line, f"for (; {condition}; {step}) {{")
        self.inner(stmt.body)
        self.emit(0, "}")
        self.depth -= 1
        self.emit(0, "}")

    def print_while(self, stmt: s.While) -> None:
        self.emit(stmt.line, f"while ({bare(self.expr(stmt.condition))}) {{")
        self.inner(stmt.body)
        self.emit(0, "}")

    def print_dowhile(self, stmt: s.DoWhile) -> None:
        self.emit(stmt.line, "do {")
        self.inner(stmt.body)
        self.emit(stmt.condition.line, f"}} while ({bare(self.expr(stmt.condition))});")

    def print_jump(self, stmt: s.Jump) -> None:
        self.emit(stmt.line, f"{stmt.word};")

    def print_return(self, stmt: s.Return) -> None:
        assert stmt.value is not None
        self.emit(stmt.line, f"return {self.expr(stmt.value)};")

    # Text

    def with_places(self, lines: Sequence[tuple[int, str]]) -> list[str]:
        """Return the lines with ``#line`` wherever the author's file and line are not those that follow by counting."""
        text: list[str] = []
        expected: tuple[int, int] | None = None
        for line, piece in lines:
            place = self.program.places[line - 1] if 0 < line <= len(self.program.places) else None
            if place is not None and place != expected:
                text.append(self.line_directive(*place))
                expected = place
            text.append(piece)
            expected = (expected[0], expected[1] + 1) if expected is not None else None
        return text

    @abstractmethod
    def line_directive(self, file: int, line: int) -> str:
        """Return the directive that gives the next line its place."""


def _symbol(parameter: s.Parameter) -> s.Symbol:
    assert parameter.symbol is not None
    return parameter.symbol


def bare(text: str) -> str:
    """Return an expression without parentheses around the whole of it: compilers warn of ``if ((a == b))``."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    open = 0
    for i, letter in enumerate(text):
        open += (letter == "(") - (letter == ")")
        if open == 0 and i < len(text) - 1:
            return text
    return text[1:-1]


def divides_plainly(divisor: s.Expr) -> bool:
    """Is the divisor a constant that no integer division stumbles over?"""
    value = divisor.constant
    return isinstance(value, int) and not isinstance(value, bool) and value > 0


def is_int(type: Type) -> bool:
    return isinstance(type, Numeric) and type.base in ("int", "uint")
