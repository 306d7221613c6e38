"""The syntax tree of a kernel. The parser makes it; the checker fills in ``type``, ``symbol`` and the like.

No expression has a side effect (assignments are statements, functions cannot write what is outside them), so printers
may evaluate operands in any order.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from .types import VOID, Struct, Type

#: A folded constant: a number, a bool, or a tuple of these for a vector.
Constant = float | int | bool | tuple[float | int | bool, ...]


@dataclass(eq=False)
class Symbol:
    """What a name stands for: ``kind`` is local, parameter, const, uniform or field. ``printed`` is unique."""

    kind: str
    name: str
    type: Type
    line: int
    printed: str
    constant: Constant | None = None
    writable: bool = False


@dataclass(eq=False)
class Expr:
    line: int
    type: Type = field(default=VOID, init=False)
    #: Value, where it is known before the kernel runs.
    constant: Constant | None = field(default=None, init=False)
    depth: int = field(default=1, init=False)


@dataclass(eq=False)
class Literal(Expr):
    kind: str
    value: float | int | bool


@dataclass(eq=False)
class Name(Expr):
    name: str
    symbol: Symbol | None = field(default=None, init=False)


@dataclass(eq=False)
class Unary(Expr):
    op: str
    operand: Expr


@dataclass(eq=False)
class Binary(Expr):
    op: str
    left: Expr
    right: Expr


@dataclass(eq=False)
class Ternary(Expr):
    condition: Expr
    yes: Expr
    no: Expr


@dataclass(eq=False)
class Call(Expr):
    """A call by name. ``target`` becomes built-in, function, constructor or field (a field accessor)."""

    name: str
    args: list[Expr]
    target: str = field(default="", init=False)


@dataclass(eq=False)
class ArrayLiteral(Expr):
    """``float[3](a, b, c)``; ``count`` is None for ``float[](...)``."""

    element: str
    count: Expr | None
    args: list[Expr]


@dataclass(eq=False)
class Index(Expr):
    base: Expr
    index: Expr


@dataclass(eq=False)
class Member(Expr):
    """A member of a struct, or components of a vector: then ``swizzle`` holds letters of xyzw."""

    base: Expr
    name: str
    swizzle: str = field(default="", init=False)


@dataclass(eq=False)
class TypeName:
    """A type as written; ``count`` is the expression in the brackets, if any."""

    name: str
    count: Expr | None
    line: int
    unsized: bool = False


@dataclass(eq=False)
class Stmt:
    line: int


@dataclass(eq=False)
class Block(Stmt):
    body: list[Stmt]


@dataclass(eq=False)
class Declare(Stmt):
    written: TypeName
    name: str
    value: Expr | None
    const: bool
    symbol: Symbol | None = field(default=None, init=False)


@dataclass(eq=False)
class Assign(Stmt):
    """``target op value`` where op is = += -= ...; ``i++`` is ``i += 1``."""

    target: Expr
    op: str
    value: Expr


@dataclass(eq=False)
class Evaluate(Stmt):
    """An expression as a statement; the checker refuses it, since it has no effect."""

    value: Expr


@dataclass(eq=False)
class If(Stmt):
    condition: Expr
    yes: Stmt
    no: Stmt | None


@dataclass(eq=False)
class For(Stmt):
    start: list[Stmt]
    condition: Expr | None
    step: list[Stmt]
    body: Stmt


@dataclass(eq=False)
class While(Stmt):
    condition: Expr
    body: Stmt


@dataclass(eq=False)
class DoWhile(Stmt):
    body: Stmt
    condition: Expr


@dataclass(eq=False)
class Jump(Stmt):
    """``break`` or ``continue``."""

    word: str


@dataclass(eq=False)
class Return(Stmt):
    value: Expr | None


@dataclass(eq=False)
class StructDecl:
    line: int
    name: str
    members: list[tuple[TypeName, str, int]]


@dataclass(eq=False)
class GlobalDecl:
    """A uniform, field or global const. ``word`` is uniform, field or const."""

    line: int
    word: str
    written: TypeName
    name: str
    value: Expr | None
    symbol: Symbol | None = field(default=None, init=False)


@dataclass(eq=False)
class Parameter:
    written: TypeName
    name: str
    line: int
    symbol: Symbol | None = field(default=None, init=False)


@dataclass(eq=False)
class Function:
    line: int
    written: TypeName
    name: str
    parameters: list[Parameter]
    body: Block
    type: Type = field(default=VOID, init=False)
    #: Names of the own functions that it calls, and the global symbols that it reads.
    calls: dict[str, int] = field(default_factory=dict, init=False)
    reads: dict[str, Symbol] = field(default_factory=dict, init=False)


@dataclass(eq=False)
class Tree:
    """A parsed file: declarations in order, and functions in order."""

    structs: list[StructDecl]
    globals: list[GlobalDecl]
    functions: list[Function]
    order: list[StructDecl | GlobalDecl]


@dataclass(eq=False)
class Program:
    """A checked kernel, for the printers. Only what the entry reaches is in it, in order of dependence."""

    entry: Function
    structs: list[Struct]
    constants: list[GlobalDecl]
    uniforms: list[Symbol]
    fields: list[Symbol]
    functions: dict[str, Function]
    places: tuple[tuple[int, int], ...]
