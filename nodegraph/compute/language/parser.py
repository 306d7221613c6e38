"""Recursive-descent parser: tokens to a syntax tree."""

from __future__ import annotations

from nodegraph.errors import ShaderError
from nodegraph.shaders import Source

from . import syntax as s
from .lexer import Token
from .types import NAMED
from .words import KEYWORDS, NOT_IN_LANGUAGE

#: Deepest nesting of statements and expressions; keeps every later pass within Python's own recursion limit.
MAX_DEPTH = 64

_LEVELS: tuple[tuple[str, ...], ...] = (
    ("||",), ("^^",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", ">", "<=", ">="), ("<<", ">>"), ("+", "-"),
    ("*", "/", "%"),
)  # fmt: skip
_PRECEDENCE = {op: level for level, ops in enumerate(_LEVELS) for op in ops}
_ASSIGN = ("=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>=")


def parse(tokens: list[Token], source: Source) -> s.Tree:
    """Return the tree of a kernel. Raises ShaderError."""
    return _Parser(tokens, source).tree()


class _Parser:
    def __init__(self, tokens: list[Token], source: Source) -> None:
        self.tokens = tokens
        self.source = source
        self.at = 0
        self.depth = 0
        self.structs: set[str] = set()

    # Tokens

    @property
    def token(self) -> Token:
        return self.tokens[self.at]

    def peek(self, ahead: int = 1) -> Token:
        return self.tokens[min(self.at + ahead, len(self.tokens) - 1)]

    def take(self) -> Token:
        token = self.token
        if token.kind != "end":
            self.at += 1
        return token

    def accept(self, text: str) -> bool:
        if self.token.text == text and self.token.kind in ("op", "name"):
            self.at += 1
            return True
        return False

    def expect(self, text: str) -> Token:
        if self.token.text != text or self.token.kind not in ("op", "name"):
            where = self.token
            if text == ";" and self.at and self.tokens[self.at - 1].line < where.line:
                where = self.tokens[self.at - 1]  # the line that lacks it, not the one where that shows
            raise self.fail(f"{text!r} is missing before {self.shown()}", where.line)
        return self.take()

    def shown(self) -> str:
        return "the end of the file" if self.token.kind == "end" else repr(self.token.text)

    def fail(self, message: str, line: int | None = None) -> ShaderError:
        return self.source.error(self.token.line if line is None else line, message)

    def enter(self) -> None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fail(f"nested more than {MAX_DEPTH} deep: use variables or functions")

    def refuse_word(self, token: Token) -> None:
        """Refuse what GLSL has and the language has not, with the cure."""
        if token.kind != "name":
            return
        cure = NOT_IN_LANGUAGE.get(token.text)
        if cure is None and token.text.startswith("gl_"):
            cure = "the kernel's position is the argument of its entry, and its result is what it returns"
        if cure is not None:
            raise self.fail(f"{token.text} is not in the language: {cure}", token.line)

    def new_name(self, what: str) -> Token:
        self.refuse_word(self.token)
        token = self.take()
        if token.kind != "name":
            raise self.fail(f"{what} needs a name here, not {token.text!r}", token.line)
        if token.text in KEYWORDS or token.text in NAMED:
            raise self.fail(f"{token.text} is a word of the language: choose another name for {what}", token.line)
        if "__" in token.text or len(token.text) > 200:
            raise self.fail(f"{token.text[:40]} is reserved: a name has no two underscores in a row", token.line)
        return token

    # Declarations

    def tree(self) -> s.Tree:
        tree = s.Tree([], [], [], [])
        while self.token.kind != "end":
            self.refuse_word(self.token)
            if self.accept(";"):
                continue
            if self.token.text == "struct":
                struct = self.struct()
                tree.structs.append(struct)
                tree.order.append(struct)
            elif self.is_function():
                tree.functions.append(self.function())
            else:
                found = self.globals()
                tree.globals += found
                tree.order += found
        return tree

    def is_type(self) -> bool:
        return self.token.kind == "name" and (self.token.text in NAMED or self.token.text in self.structs)

    def is_function(self) -> bool:
        """Is this ``type name (`` or ``type[n] name (``?"""
        at = self.at + 1
        if at < len(self.tokens) and self.tokens[at].text == "[":
            while at < len(self.tokens) - 1 and self.tokens[at].text not in ("]", ";"):
                at += 1
            at += 1
        following = self.tokens[at : at + 2]
        return len(following) == 2 and following[0].kind == "name" and following[1].text == "("

    def written_type(self) -> s.TypeName:
        self.refuse_word(self.token)
        token = self.take()
        if token.kind != "name" or (token.text not in NAMED and token.text not in self.structs):
            if token.kind == "name" and token.text in KEYWORDS:
                raise self.fail(f"{token.text!r} does not belong here", token.line)
            hint = "" if token.kind != "name" else ": a struct is declared before it is used"
            raise self.fail(f"{token.text or 'the end of the file'!r} is no type{hint}", token.line)
        written = s.TypeName(token.text, None, token.line)
        self.brackets(written)
        return written

    def brackets(self, written: s.TypeName) -> None:
        """Read ``[n]`` after a type or a declared name."""
        if self.token.text != "[":
            return
        if written.count is not None or written.unsized:
            raise self.fail("arrays of arrays are not in the language: use one array or a struct")
        self.take()
        if self.accept("]"):
            written.unsized = True
            return
        written.count = self.expression()
        self.expect("]")
        if self.token.text == "[":
            raise self.fail("arrays of arrays are not in the language: use one array or a struct")

    def struct(self) -> s.StructDecl:
        line = self.take().line
        name = self.new_name("a struct")
        self.expect("{")
        members: list[tuple[s.TypeName, str, int]] = []
        while not self.accept("}"):
            base = self.written_type()
            while True:
                own = s.TypeName(base.name, base.count, base.line, base.unsized)
                member = self.new_name("a member")
                self.brackets(own)
                members.append((own, member.text, member.line))
                if not self.accept(","):
                    break
            self.expect(";")
        if self.token.text != ";":
            raise self.fail("a struct ends with '};' and declares no variable at once", line)
        self.take()
        self.structs.add(name.text)
        return s.StructDecl(line, name.text, members)

    def globals(self) -> list[s.GlobalDecl]:
        line = self.token.line
        word = self.token.text if self.token.text in ("uniform", "const") else "field"
        if word != "field":
            self.take()
        base = self.written_type()
        if word == "field" and not base.name.startswith("field"):
            raise self.fail("a global is a uniform, a const or a field: write one of these words before its type", line)
        found = []
        while True:
            own = s.TypeName(base.name, base.count, base.line, base.unsized)
            name = self.new_name(f"a {word}")
            self.brackets(own)
            value = self.expression() if self.accept("=") else None
            found.append(s.GlobalDecl(name.line, word, own, name.text, value))
            if not self.accept(","):
                break
        self.expect(";")
        return found

    def function(self) -> s.Function:
        line = self.token.line
        written = self.written_type()
        name = self.new_name("a function")
        self.expect("(")
        parameters = []
        if self.token.text == "void" and self.peek().text == ")":
            self.take()
        while not self.accept(")"):
            if parameters:
                self.expect(",")
            if self.token.text in ("const", "in"):
                self.take()
            own = self.written_type()
            parameter = self.new_name("a parameter")
            self.brackets(own)
            parameters.append(s.Parameter(own, parameter.text, parameter.line))
        if self.token.text == ";":
            raise self.fail("prototypes are not needed: functions may stand in any order", line)
        if self.token.text != "{":
            raise self.fail(f"'{{' is missing before {self.shown()}")
        return s.Function(line, written, name.text, parameters, self.block())

    # Statements

    def block(self) -> s.Block:
        line = self.expect("{").line
        self.enter()
        body: list[s.Stmt] = []
        while not self.accept("}"):
            if self.token.kind == "end":
                raise self.fail("this '{' is never closed", line)
            body += self.statements()
        self.depth -= 1
        return s.Block(line, body)

    def statement(self) -> s.Stmt:
        """Read one statement, as after ``if (...)``."""
        line = self.token.line
        found = self.statements()
        return found[0] if len(found) == 1 and not isinstance(found[0], s.Declare) else s.Block(line, found)

    def statements(self) -> list[s.Stmt]:
        """Read one statement; a declaration of several names gives several."""
        self.refuse_word(self.token)
        line, word = self.token.line, self.token.text
        if word == "{":
            return [self.block()]
        if self.accept(";"):
            return []
        self.enter()
        try:
            if self.token.kind == "name" and word in ("if", "for", "while", "do", "break", "continue", "return"):
                self.take()
                return [getattr(self, f"{word}_")(line)]
            found = self.simple()
            self.expect(";")
            return found
        finally:
            self.depth -= 1

    def if_(self, line: int) -> s.Stmt:
        self.expect("(")
        condition = self.expression()
        self.expect(")")
        yes = self.statement()
        no = self.statement() if self.accept("else") else None
        return s.If(line, condition, yes, no)

    def for_(self, line: int) -> s.Stmt:
        self.expect("(")
        start = [] if self.token.text == ";" else self.simple()
        self.expect(";")
        condition = None if self.token.text == ";" else self.expression()
        self.expect(";")
        step: list[s.Stmt] = []
        if self.token.text != ")":
            step = self.simple()
            if any(isinstance(part, s.Declare) for part in step):
                raise self.fail("a declaration does not belong here", line)
        self.expect(")")
        return s.For(line, start, condition, step, self.statement())

    def while_(self, line: int) -> s.Stmt:
        self.expect("(")
        condition = self.expression()
        self.expect(")")
        return s.While(line, condition, self.statement())

    def do_(self, line: int) -> s.Stmt:
        body = self.statement()
        self.expect("while")
        self.expect("(")
        condition = self.expression()
        self.expect(")")
        self.expect(";")
        return s.DoWhile(line, body, condition)

    def break_(self, line: int) -> s.Stmt:
        self.expect(";")
        return s.Jump(line, "break")

    def continue_(self, line: int) -> s.Stmt:
        self.expect(";")
        return s.Jump(line, "continue")

    def return_(self, line: int) -> s.Stmt:
        value = None if self.token.text == ";" else self.expression()
        self.expect(";")
        return s.Return(line, value)

    def simple(self) -> list[s.Stmt]:
        """Read a declaration, an assignment, ++ or --, without the semicolon."""
        self.refuse_word(self.token)
        line = self.token.line
        if self.token.text in ("const", "uniform", "struct", "in"):
            if self.token.text != "const":
                raise self.fail(f"a {self.token.text} declaration belongs outside functions")
            return self.declare()
        if self.is_type() and (self.peek().kind == "name" or self.starts_array_declaration()):
            return self.declare()
        if self.token.kind == "name" and self.peek().kind == "name" and self.token.text not in KEYWORDS:
            raise self.fail(f"{self.token.text!r} is no type: a struct is declared before it is used")
        if self.token.text in ("++", "--"):
            op = self.take().text
            return [self.increment(line, self.unary(), op)]
        target = self.expression()
        if self.token.text in ("++", "--"):
            return [self.increment(line, target, self.take().text)]
        if self.token.text in _ASSIGN and self.token.kind == "op":
            op = self.take().text
            value = self.expression()
            if self.token.text in _ASSIGN:
                raise self.fail("an assignment is a statement of its own, with one target")
            return [s.Assign(line, target, op, value)]
        return [s.Evaluate(line, target)]

    def starts_array_declaration(self) -> bool:
        """Is this ``type[n] name``, as opposed to ``type[n](...)``?"""
        if self.peek().text != "[":
            return False
        at = self.at + 1
        while at < len(self.tokens) - 1 and self.tokens[at].text not in ("]", ";"):
            at += 1
        return at + 1 < len(self.tokens) and self.tokens[at + 1].kind == "name"

    def increment(self, line: int, target: s.Expr, op: str) -> s.Stmt:
        return s.Assign(line, target, op, s.Literal(line, "one", 1))

    def declare(self) -> list[s.Stmt]:
        line = self.token.line
        const = self.accept("const")
        base = self.written_type()
        found: list[s.Stmt] = []
        while True:
            own = s.TypeName(base.name, base.count, base.line, base.unsized)
            name = self.new_name("a variable")
            self.brackets(own)
            value = self.expression() if self.accept("=") else None
            found.append(s.Declare(line, own, name.text, value, const))
            if not self.accept(","):
                return found

    # Expressions

    def expression(self) -> s.Expr:
        self.enter()
        result = self.ternary()
        self.depth -= 1
        if self.token.text in ("++", "--") and self.peek().text not in (";", ")"):
            raise self.fail(f"{self.token.text} is a statement of its own, not part of an expression")
        return result

    def ternary(self) -> s.Expr:
        condition = self.binary(0)
        if self.token.text != "?":
            return condition
        line = self.take().line
        yes = self.expression()
        self.expect(":")
        no = self.expression()
        return self.deepen(s.Ternary(line, condition, yes, no), condition, yes, no)

    def deepen(self, node: s.Expr, *parts: s.Expr) -> s.Expr:
        """Limit the depth of the tree, which for ``a + b + c + ...`` grows without any nesting in the text."""
        node.depth = 1 + max((part.depth for part in parts), default=0)
        if node.depth > 2 * MAX_DEPTH:
            raise self.fail(f"this expression has more than {2 * MAX_DEPTH} steps: use variables", node.line)
        return node

    def binary(self, level: int) -> s.Expr:
        """Precedence climbing over ``_LEVELS``."""
        left = self.unary()
        while True:
            op = self.token.text
            own = _PRECEDENCE.get(op, -1) if self.token.kind == "op" else -1
            if own < level:
                return left
            line = self.take().line
            self.enter()
            right = self.binary(own + 1)
            self.depth -= 1
            left = self.deepen(s.Binary(line, op, left, right), left, right)

    def unary(self) -> s.Expr:
        token = self.token
        if token.kind == "op" and token.text in ("-", "+", "!", "~"):
            self.take()
            self.enter()
            operand = self.unary()
            self.depth -= 1
            return self.deepen(s.Unary(token.line, token.text, operand), operand)
        if token.text in ("++", "--"):
            raise self.fail(f"{token.text} is a statement of its own, not part of an expression")
        return self.postfix()

    def postfix(self) -> s.Expr:
        result = self.primary()
        while True:
            line = self.token.line
            if self.accept("["):
                index = self.expression()
                self.expect("]")
                result = self.deepen(s.Index(line, result, index), result, index)
            elif self.accept("."):
                name = self.take()
                if name.kind != "name":
                    raise self.fail(f"a member's name is missing after '.', before {name.text!r}", line)
                if self.token.text == "(":
                    raise self.fail(
                        f".{name.text}() is not in the language: the length of an array is a constant", line
                    )
                result = self.deepen(s.Member(line, result, name.text), result)
            else:
                return result

    def primary(self) -> s.Expr:
        self.refuse_word(self.token)
        token = self.take()
        line = token.line
        if token.kind in ("int", "uint"):
            return s.Literal(line, token.kind, int(token.text, 0))
        if token.kind == "float":
            return s.Literal(line, "float", float(token.text))
        if token.kind == "bool":
            return s.Literal(line, "bool", token.text == "true")
        if token.text == "(":
            inside = self.expression()
            if self.token.text == ",":
                raise self.fail("the comma operator is not in the language")
            self.expect(")")
            return inside
        is_type = token.text in NAMED or token.text in self.structs
        if token.kind == "name" and (is_type or token.text not in KEYWORDS):
            if is_type and self.token.text == "[":
                return self.array_literal(token)
            if self.token.text == "(":
                return self.call(token)
            if is_type:
                raise self.fail(f"{token.text} is a type, and a value is needed here", line)
            return s.Name(line, token.text)
        shown = "the end of the file" if token.kind == "end" else repr(token.text)
        raise self.fail(f"an expression is needed before {shown}", line)

    def arguments(self) -> list[s.Expr]:
        self.expect("(")
        args: list[s.Expr] = []
        if self.token.text == "void" and self.peek().text == ")":
            self.take()
        while not self.accept(")"):
            if args:
                self.expect(",")
            args.append(self.expression())
        return args

    def call(self, token: Token) -> s.Expr:
        args = self.arguments()
        return self.deepen(s.Call(token.line, token.text, args), *args)

    def array_literal(self, token: Token) -> s.Expr:
        self.expect("[")
        count = None if self.token.text == "]" else self.expression()
        self.expect("]")
        args = self.arguments()
        return self.deepen(s.ArrayLiteral(token.line, token.text, count, args), *args)
