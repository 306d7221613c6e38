"""Recursive-descent parser: tokens to a syntax tree. Declarations and statements are here."""

from __future__ import annotations

from nodegraph.shaders import Source

from . import syntax as s
from .lexer import Token
from .parse_expressions import ExpressionParser
from .types import NAMED
from .words import KEYWORDS

_ASSIGN = ("=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>=")


def parse(tokens: list[Token], source: Source) -> s.Tree:
    """Return the tree of a kernel. Raises ShaderError."""
    return _Parser(tokens, source).tree()


class _Parser(ExpressionParser):
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
        parameters: list[s.Parameter] = []
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
