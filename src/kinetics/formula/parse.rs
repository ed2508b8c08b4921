//! Text of a formula to a tree, with the place of everything in the text.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = sign { ("*" | "/") sign }
//! sign    = { "-" | "+" } power
//! power   = atom [ "^" sign ]                      2^3^2 = 2^(3^2), -x^2 = -(x^2)
//! atom    = number | name | function "(" sum { "," sum } ")" | "(" sum ")"
//! ```

use std::ops::Range;

use rumple_numerics::num::checked::{LARGEST, SMALLEST};

use super::foreign_names::written_here;
use crate::error::nearest;

/// What is wrong with a formula, and where in its text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message} (byte {}){}", span.start, help.as_ref().map(|help| format!("; {help}")).unwrap_or_default())]
pub struct FormulaError {
    /// Bytes of the text.
    pub span: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// What would help.
    pub help: Option<String>,
}

impl FormulaError {
    pub(super) fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), help: None }
    }

    pub(super) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Functions that formulas know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Function {
    /// `max(x, 0)`.
    Pos,
    /// Heaviside's step: 1 for x > 0, else 0.
    Step,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Square root.
    Sqrt,
    /// Hyperbolic tangent.
    Tanh,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Absolute value.
    Abs,
    /// `1/(1 + exp(-x))`, which does not overflow.
    Logistic,
    /// The lesser of two.
    Min,
    /// The greater of two.
    Max,
    /// `hill(x, k, n) = x^n/(k^n + x^n)` for x ≥ 0, else 0.
    Hill,
}

/// Names, numbers of arguments and meanings of all functions.
pub const FUNCTIONS: [(&str, Function, usize); 13] = [
    ("pos", Function::Pos, 1),
    ("step", Function::Step, 1),
    ("exp", Function::Exp, 1),
    ("log", Function::Log, 1),
    ("sqrt", Function::Sqrt, 1),
    ("tanh", Function::Tanh, 1),
    ("sin", Function::Sin, 1),
    ("cos", Function::Cos, 1),
    ("abs", Function::Abs, 1),
    ("logistic", Function::Logistic, 1),
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
    ("hill", Function::Hill, 3),
];

/// Operations between two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operation {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

/// A part of a formula.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tree {
    pub(super) span: Range<usize>,
    pub(super) kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Number(f64),
    Name(String),
    Negative(Box<Tree>),
    Binary(Operation, Box<Tree>, Box<Tree>),
    Call(Function, Vec<Tree>),
}

impl Tree {
    /// Hands every name in it to `each`.
    pub(super) fn names(&self, each: &mut impl FnMut(&str)) {
        match &self.kind {
            Kind::Number(_) => {}
            Kind::Name(name) => each(name),
            Kind::Negative(inner) => inner.names(each),
            Kind::Binary(_, left, right) => {
                left.names(each);
                right.names(each);
            }
            Kind::Call(_, all) => all.iter().for_each(|part| part.names(each)),
        }
    }
}

/// Formulas may be nested this deep, and be this long.
const MAX_DEPTH: usize = 100;
const MAX_LENGTH: usize = 2_000;

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Symbol(char),
}

/// Parses `text`.
pub(super) fn parse(text: &str) -> Result<Tree, FormulaError> {
    if text.len() > MAX_LENGTH {
        let message = format!("a formula has at most {MAX_LENGTH} bytes");
        return Err(FormulaError::new(0..text.len(), message));
    }
    let tokens = tokens(text)?;
    let mut parser = Parser { tokens, next: 0, end: text.len(), depth: 0 };
    if parser.tokens.is_empty() {
        return Err(FormulaError::new(0..text.len(), "an empty formula"));
    }
    let tree = parser.sum()?;
    match parser.peek() {
        None => Ok(tree),
        Some((Token::Symbol(')'), span)) => {
            Err(FormulaError::new(span.clone(), "unmatched closing parenthesis"))
        }
        Some((_, span)) => {
            Err(FormulaError::new(span.clone(), "an operator is missing before this")
                .help("a product needs an operator: 2*x"))
        }
    }
}

fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, FormulaError> {
    let mut found = Vec::new();
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(character) = text[at..].chars().next() {
        let start = at;
        if character.is_whitespace() {
            at += character.len_utf8();
        } else if character == '.' && text[at + 1..].starts_with(char::is_alphabetic) {
            let help = "functions stand alone, without a module: sin(x)";
            return Err(FormulaError::new(start..at + 1, "unexpected character `.` in a formula")
                .help(help));
        } else if character.is_ascii_digit() || character == '.' {
            let digit = |k: usize| bytes.get(k).is_some_and(u8::is_ascii_digit);
            while digit(at) || bytes.get(at) == Some(&b'.') {
                at += 1;
            }
            if matches!(bytes.get(at), Some(b'e' | b'E')) {
                let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
                if digit(at + 1 + sign) {
                    at += 1 + sign;
                    while digit(at) {
                        at += 1;
                    }
                }
            }
            let value = text[start..at].parse::<f64>().ok().filter(|value| value.is_finite());
            let Some(value) = value else {
                return Err(FormulaError::new(start..at, "not a finite number"));
            };
            if value != 0.0 && !(SMALLEST..=LARGEST).contains(&value) {
                let range = format!("not of a size between {SMALLEST:e} and {LARGEST:e}");
                return Err(FormulaError::new(start..at, range));
            }
            found.push((Token::Number(value), start..at));
        } else if character.is_alphabetic() || character == '_' {
            let inside = |c: char| c.is_alphanumeric() || c == '_';
            at += text[at..].find(|c| !inside(c)).unwrap_or(text.len() - at);
            found.push((Token::Name(text[start..at].to_owned()), start..at));
        } else if "+-*/^(),".contains(character) {
            at += 1;
            // As in Python and Fortran.
            let power = character == '*' && bytes.get(at) == Some(&b'*');
            at += usize::from(power);
            found.push((Token::Symbol(if power { '^' } else { character }), start..at));
        } else {
            at += character.len_utf8();
            let message = format!("unexpected character `{character}` in a formula");
            let help = match character {
                '<' | '>' | '=' | '!' | '?' => {
                    "there are no comparisons: step(x - y) is 1 where x > y and 0 elsewhere; min, max and pos serve too"
                }
                _ => "numbers, names, + - * / ^, parentheses and functions",
            };
            return Err(FormulaError::new(start..at, message).help(help));
        }
    }
    Ok(found)
}

struct Parser {
    tokens: Vec<(Token, Range<usize>)>,
    next: usize,
    end: usize,
    depth: usize,
}

impl Parser {
    fn peek(&self) -> Option<&(Token, Range<usize>)> {
        self.tokens.get(self.next)
    }

    fn accept(&mut self, symbols: &str) -> Option<(char, Range<usize>)> {
        match self.peek() {
            Some((Token::Symbol(symbol), span)) if symbols.contains(*symbol) => {
                let found = (*symbol, span.clone());
                self.next += 1;
                Some(found)
            }
            _ => None,
        }
    }

    fn sum(&mut self) -> Result<Tree, FormulaError> {
        self.chain("+-", Self::product)
    }

    fn product(&mut self) -> Result<Tree, FormulaError> {
        self.chain("*/", Self::sign)
    }

    fn chain(
        &mut self,
        symbols: &str,
        part: fn(&mut Self) -> Result<Tree, FormulaError>,
    ) -> Result<Tree, FormulaError> {
        let mut left = part(self)?;
        while let Some((symbol, _)) = self.accept(symbols) {
            let operation = match symbol {
                '+' => Operation::Add,
                '-' => Operation::Subtract,
                '*' => Operation::Multiply,
                _ => Operation::Divide,
            };
            let right = part(self)?;
            left = binary(operation, left, right);
        }
        Ok(left)
    }

    fn sign(&mut self) -> Result<Tree, FormulaError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let span = self.peek().map_or(self.end..self.end, |(_, span)| span.clone());
            return Err(FormulaError::new(span, "nested too deeply"));
        }
        let tree = match self.accept("+-") {
            Some(('-', span)) => {
                let inner = self.sign()?;
                Tree { span: span.start..inner.span.end, kind: Kind::Negative(Box::new(inner)) }
            }
            Some(_) => self.sign()?,
            None => {
                let base = self.atom()?;
                match self.accept("^") {
                    Some(_) => {
                        let exponent = self.sign()?;
                        binary(Operation::Power, base, exponent)
                    }
                    None => base,
                }
            }
        };
        self.depth -= 1;
        Ok(tree)
    }

    fn atom(&mut self) -> Result<Tree, FormulaError> {
        let Some((token, span)) = self.peek().cloned() else {
            return Err(FormulaError::new(self.end..self.end, "the formula ends too early")
                .help("a number, a name or a parenthesis belongs here"));
        };
        self.next += 1;
        match token {
            Token::Number(value) => Ok(Tree { span, kind: Kind::Number(value) }),
            Token::Name(name) => match self.accept("(") {
                Some((_, open)) => self.call(&name, span, &open),
                None => Ok(Tree { span, kind: Kind::Name(name) }),
            },
            Token::Symbol('(') => {
                let inner = self.sum()?;
                let close = self.close(&span)?;
                Ok(Tree { span: span.start..close, kind: inner.kind })
            }
            Token::Symbol(symbol) => {
                let message =
                    format!("a number, a name or a parenthesis belongs here, not `{symbol}`");
                Err(FormulaError::new(span, message))
            }
        }
    }

    fn close(&mut self, open: &Range<usize>) -> Result<usize, FormulaError> {
        match self.accept(")") {
            Some((_, span)) => Ok(span.end),
            None => Err(FormulaError::new(open.clone(), "this parenthesis is not closed")),
        }
    }

    fn call(
        &mut self,
        name: &str,
        span: Range<usize>,
        open: &Range<usize>,
    ) -> Result<Tree, FormulaError> {
        let Some((_, function, count)) = FUNCTIONS.into_iter().find(|f| f.0 == name) else {
            let names: Vec<&str> = FUNCTIONS.iter().map(|f| f.0).collect();
            let near = nearest(name, names.iter().copied());
            let help = match (written_here(name), near) {
                (Some(here), _) => format!("write {here}; there are {}", names.join(", ")),
                (None, Some(near)) => {
                    format!("did you mean `{near}`? There are {}", names.join(", "))
                }
                (None, None) => format!("there are {}", names.join(", ")),
            };
            return Err(FormulaError::new(span, format!("unknown function `{name}`")).help(help));
        };
        let mut arguments = vec![self.sum()?];
        while self.accept(",").is_some() {
            arguments.push(self.sum()?);
        }
        let end = self.close(open)?;
        if arguments.len() != count {
            let message = format!("`{name}` takes {count} argument(s), not {}", arguments.len());
            return Err(FormulaError::new(span.start..end, message));
        }
        Ok(Tree { span: span.start..end, kind: Kind::Call(function, arguments) })
    }
}

fn binary(operation: Operation, left: Tree, right: Tree) -> Tree {
    let span = left.span.start..right.span.end;
    Tree { span, kind: Kind::Binary(operation, Box::new(left), Box::new(right)) }
}
