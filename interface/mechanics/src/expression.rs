//! Expressions of scenes: compiled once with every name resolved, evaluated over a slice of numbers.
//!
//! ```text
//! sum     = product (("+" | "-") product)*
//! product = signed (("*" | "/") signed)*
//! signed  = ("-" | "+") signed | power
//! power   = atom ("^" signed)?                     -2^2 is -4 and 2^3^2 is 2^9, as on paper
//! atom    = number | name | function "(" sum ("," sum)* ")" | "(" sum ")"
//! ```
//!
//! Names may hold dots (`body.target.vx`). NaN is never lost: `min` and `max` of NaN are NaN, so that a check on them
//! fails.
//!
//! This is our own code and not the crate exmex, because three rules of that crate compute wrong numbers from formulas
//! that look right: `-2^2` is 4, a `min` within a `max` does not parse, and `min(NaN, 1)` is 1.

use std::ops::Range;

/// Deepest nesting of an expression; far beyond what a person writes, and safe for the stack.
const DEPTH_LIMIT: usize = 100;
/// Most operators and functions of an expression: a sum of as many terms is as deep a tree.
const OPERATORS_LIMIT: usize = 2000;

/// What a name stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Meaning {
    /// A number known when the expression is compiled.
    Number(f64),
    /// The number in this slot when the expression is evaluated.
    Slot(usize),
}

/// Why a text is not an expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpressionError {
    /// The bytes of the text with the fault.
    pub at: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// The unknown name, if that is the fault.
    pub unknown_name: Option<String>,
}

impl ExpressionError {
    fn new(at: Range<usize>, message: String) -> Self {
        Self {
            at,
            message,
            unknown_name: None,
        }
    }
}

/// A compiled expression.
#[derive(Debug, Clone)]
pub struct Expression {
    source: String,
    root: Node,
}

#[derive(Debug, Clone)]
enum Node {
    Number(f64),
    Slot(usize),
    Unary(Unary, Box<Node>),
    Binary(Binary, Box<Node>, Box<Node>),
}

impl Expression {
    /// Compiles `source`; `meaning` returns the meaning of a name.
    ///
    /// # Errors
    /// [`ExpressionError`] with the part of the text that is at fault.
    pub fn compile(
        source: &str,
        meaning: &dyn Fn(&str) -> Option<Meaning>,
    ) -> Result<Self, ExpressionError> {
        let mut parser = Parser {
            source,
            rest: source,
            depth: 0,
            operators: 0,
            meaning,
        };
        let root = parser.sum()?;
        match parser.peek() {
            ("", _) => Ok(Self {
                source: source.to_owned(),
                root,
            }),
            _ => Err(parser.unexpected("an operator or the end")),
        }
    }

    /// The expression that is always `value`.
    pub fn constant(value: f64) -> Self {
        Self {
            source: value.to_string(),
            root: Node::Number(value),
        }
    }

    /// The value over `slots`.
    ///
    /// # Panics
    /// If a slot that the names were resolved to does not exist: an assertion, both come from the same registry.
    pub fn evaluate(&self, slots: &[f64]) -> f64 {
        self.root.evaluate(&|slot| slots[slot])
    }

    /// The value, with what `slot` gives for the number of a slot.
    pub fn evaluate_with(&self, slot: &impl Fn(usize) -> f64) -> f64 {
        self.root.evaluate(slot)
    }

    /// The value, if it depends on no slot.
    pub fn as_number(&self) -> Option<f64> {
        match self.root {
            Node::Number(value) => Some(value),
            _ => None,
        }
    }

    /// Whether it contains a slot for which `is` holds.
    pub fn uses(&self, is: &dyn Fn(usize) -> bool) -> bool {
        self.root.uses(is)
    }

    /// Splits off the largest parts that use slots for which `is` holds, and no others. In what is left their values stand in
    /// the slots from `first` on.
    pub fn split_off(&mut self, is: &dyn Fn(usize) -> bool, first: usize) -> Vec<Self> {
        let mut parts = Vec::new();
        self.root.split_off(is, first, &mut parts);
        let with_source = |root| Self {
            source: self.source.clone(),
            root,
        };
        parts.into_iter().map(with_source).collect()
    }

    /// The text as written.
    pub fn source(&self) -> &str {
        &self.source
    }
}

impl Node {
    fn evaluate(&self, slot: &impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Slot(number) => slot(*number),
            Self::Unary(apply, a) => apply(a.evaluate(slot)),
            Self::Binary(apply, a, b) => apply(a.evaluate(slot), b.evaluate(slot)),
        }
    }

    fn uses(&self, is: &dyn Fn(usize) -> bool) -> bool {
        match self {
            Self::Number(_) => false,
            Self::Slot(slot) => is(*slot),
            Self::Unary(_, a) => a.uses(is),
            Self::Binary(_, a, b) => a.uses(is) || b.uses(is),
        }
    }

    fn split_off(&mut self, is: &dyn Fn(usize) -> bool, first: usize, parts: &mut Vec<Self>) {
        if self.uses(&|_| true) && !self.uses(&|slot| !is(slot)) {
            let place = Self::Slot(first + parts.len());
            parts.push(std::mem::replace(self, place));
            return;
        }
        match self {
            Self::Number(_) | Self::Slot(_) => {}
            Self::Unary(_, a) => a.split_off(is, first, parts),
            Self::Binary(_, a, b) => {
                a.split_off(is, first, parts);
                b.split_off(is, first, parts);
            }
        }
    }

    /// `apply(a)`, computed now if `a` is a number.
    fn unary(apply: Unary, a: Self) -> Self {
        match a {
            Self::Number(a) => Self::Number(apply(a)),
            a => Self::Unary(apply, Box::new(a)),
        }
    }

    /// `apply(a, b)`, computed now if both are numbers.
    fn binary(apply: Binary, a: Self, b: Self) -> Self {
        match (a, b) {
            (Self::Number(a), Self::Number(b)) => Self::Number(apply(a, b)),
            (a, b) => Self::Binary(apply, Box::new(a), Box::new(b)),
        }
    }
}

/// A function of one number.
type Unary = fn(f64) -> f64;
/// A function of two numbers.
type Binary = fn(f64, f64) -> f64;

const FUNCTIONS: [(&str, Unary); 15] = [
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log10", f64::log10),
    ("sqrt", f64::sqrt),
    ("abs", f64::abs),
    ("sign", sign),
];

const FUNCTIONS_OF_TWO: [(&str, Binary); 3] =
    [("min", smaller), ("max", larger), ("atan2", f64::atan2)];

/// NaN if either number is NaN, unlike `f64::min`.
fn smaller(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.min(b)
    }
}

/// NaN if either number is NaN, unlike `f64::max`.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

/// -1, 0 or 1, or NaN for NaN. The sign of 0 is 0, unlike that of `f64::signum`.
fn sign(a: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a.signum() }
}

/// Names that a scene's constants may not take: functions and `pi`.
pub fn reserved_names() -> impl Iterator<Item = &'static str> {
    let one = FUNCTIONS.iter().map(|(name, _)| *name);
    let two = FUNCTIONS_OF_TWO.iter().map(|(name, _)| *name);
    one.chain(two).chain(["pi"])
}

/// The number, name or sign with which a text begins; nothing at its end.
fn first_word(text: &str) -> &str {
    let end = match text.chars().next() {
        Some(c) if begins_number(c) => number_end(text.as_bytes()),
        Some(c) if begins_name(c) => count_while(text.as_bytes(), 0, |b| {
            b.is_ascii_alphanumeric() || b == b'_' || b == b'.'
        }),
        other => other.map_or(0, char::len_utf8),
    };
    &text[..end]
}

fn begins_number(c: char) -> bool {
    c.is_ascii_digit() || c == '.'
}

fn begins_name(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_'
}

/// The end of a run of bytes for which `is` holds.
fn count_while(bytes: &[u8], from: usize, is: impl Fn(u8) -> bool) -> usize {
    from + bytes[from..].iter().take_while(|b| is(**b)).count()
}

/// The end of a number: digits and points, then perhaps an exponent with its sign.
fn number_end(bytes: &[u8]) -> usize {
    let digits = |at| count_while(bytes, at, |b| begins_number(b.into()));
    let mantissa = digits(0);
    if !matches!(bytes.get(mantissa), Some(b'e' | b'E')) {
        return mantissa;
    }
    let sign = usize::from(matches!(bytes.get(mantissa + 1), Some(b'+' | b'-')));
    let exponent = digits(mantissa + 1 + sign);
    if exponent == mantissa + 1 + sign {
        mantissa
    } else {
        exponent
    }
}

struct Parser<'a> {
    source: &'a str,
    /// What is not read yet.
    rest: &'a str,
    depth: usize,
    operators: usize,
    meaning: &'a dyn Fn(&str) -> Option<Meaning>,
}

impl<'a> Parser<'a> {
    /// The next number, name or sign, with its place; nothing at the end.
    fn peek(&mut self) -> (&'a str, Range<usize>) {
        self.rest = self.rest.trim_start();
        let (at, word) = (self.source.len() - self.rest.len(), first_word(self.rest));
        (word, at..at + word.len())
    }

    /// Takes the next sign if it is one of `signs`.
    fn take(&mut self, signs: &str) -> Option<char> {
        let sign = self.peek().0.chars().next()?;
        self.rest = self.rest.strip_prefix(|c| signs.contains(c))?;
        Some(sign)
    }

    fn expect(&mut self, sign: char) -> Result<(), ExpressionError> {
        match self.take(sign.encode_utf8(&mut [0; 4])) {
            Some(_) => Ok(()),
            None => Err(self.unexpected(&format!("`{sign}`"))),
        }
    }

    fn unexpected(&mut self, expected: &str) -> ExpressionError {
        let found = match self.peek() {
            ("", at) => ("the end".to_owned(), at),
            (word, at) => (format!("`{word}`"), at),
        };
        let (found, at) = found;
        ExpressionError::new(at, format!("found {found} where {expected} should be"))
    }

    /// What is wrong with the text as a whole.
    fn too_much(&self, message: String) -> ExpressionError {
        ExpressionError::new(0..self.source.len(), message)
    }

    /// Counts one more operator.
    fn operator(&mut self) -> Result<(), ExpressionError> {
        self.operators += 1;
        if self.operators > OPERATORS_LIMIT {
            return Err(self.too_much(format!("more than {OPERATORS_LIMIT} operators")));
        }
        Ok(())
    }

    fn sum(&mut self) -> Result<Node, ExpressionError> {
        self.chain([('+', |a, b| a + b), ('-', |a, b| a - b)], Self::product)
    }

    fn product(&mut self) -> Result<Node, ExpressionError> {
        self.chain([('*', |a, b| a * b), ('/', |a, b| a / b)], Self::signed)
    }

    /// Parts between two operators that bind alike, from left to right.
    fn chain(
        &mut self,
        [(one, first), (other, second)]: [(char, Binary); 2],
        part: fn(&mut Self) -> Result<Node, ExpressionError>,
    ) -> Result<Node, ExpressionError> {
        let mut left = part(self)?;
        while let Some(sign) = self.take(&String::from_iter([one, other])) {
            self.operator()?;
            let apply = if sign == one { first } else { second };
            left = Node::binary(apply, left, part(self)?);
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<Node, ExpressionError> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT {
            return Err(self.too_much(format!("nested deeper than {DEPTH_LIMIT} levels")));
        }
        let node = match self.take("+-") {
            Some('-') => Node::unary(|a| -a, self.signed()?),
            Some(_) => self.signed()?,
            None => self.power()?,
        };
        self.depth -= 1;
        Ok(node)
    }

    fn power(&mut self) -> Result<Node, ExpressionError> {
        let base = self.atom()?;
        match self.take("^") {
            Some(_) => Ok(Node::binary(f64::powf, base, self.signed()?)),
            None => Ok(base),
        }
    }

    fn atom(&mut self) -> Result<Node, ExpressionError> {
        if self.take("(").is_some() {
            let inner = self.sum()?;
            self.expect(')')?;
            return Ok(inner);
        }
        let (word, at) = self.peek();
        if word.starts_with(begins_number) {
            self.rest = &self.rest[word.len()..];
            let fault = |_| ExpressionError::new(at, format!("`{word}` is not a number"));
            word.parse().map(Node::Number).map_err(fault)
        } else if word.starts_with(begins_name) {
            self.rest = &self.rest[word.len()..];
            self.name(word, at)
        } else {
            Err(self.unexpected("a number, a name or `(`"))
        }
    }

    fn name(&mut self, name: &str, at: Range<usize>) -> Result<Node, ExpressionError> {
        if let Some((_, apply)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            self.expect('(')?;
            let a = self.sum()?;
            self.expect(')')?;
            return Ok(Node::unary(*apply, a));
        }
        if let Some((_, apply)) = FUNCTIONS_OF_TWO.iter().find(|(known, _)| *known == name) {
            self.expect('(')?;
            let a = self.sum()?;
            self.expect(',')?;
            let b = self.sum()?;
            self.expect(')')?;
            return Ok(Node::binary(*apply, a, b));
        }
        if name == "pi" {
            return Ok(Node::Number(std::f64::consts::PI));
        }
        match (self.meaning)(name) {
            Some(Meaning::Number(value)) => Ok(Node::Number(value)),
            Some(Meaning::Slot(slot)) => Ok(Node::Slot(slot)),
            None => Err(ExpressionError {
                unknown_name: Some(name.to_owned()),
                ..ExpressionError::new(at, format!("`{name}` is not known here"))
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(source: &str) -> f64 {
        let meaning = |name: &str| match name {
            "t" => Some(Meaning::Slot(0)),
            "body.a_1.vx" => Some(Meaning::Slot(1)),
            "Z" => Some(Meaning::Number(4.0)),
            _ => None,
        };
        Expression::compile(source, &meaning)
            .unwrap_or_else(|e| panic!("{source}: {}", e.message))
            .evaluate(&[3.0, 5.0])
    }

    fn fault(source: &str) -> ExpressionError {
        Expression::compile(source, &|_| None).unwrap_err()
    }

    #[test]
    fn operators_bind_as_on_paper() {
        for (source, expected) in [
            ("1 + 2*3", 7.0),
            ("8/4/2", 1.0),
            ("8/4*2", 4.0),
            ("1-2-3", -4.0),
            ("-2^2", -4.0),
            ("(-2)^2", 4.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("2*-3", -6.0),
            ("- -3", 3.0),
            ("2.5e-1 + .5", 0.75),
            ("1e3", 1000.0),
        ] {
            assert_eq!(value(source), expected, "{source}");
        }
    }

    #[test]
    fn functions_nest_and_names_resolve() {
        assert_eq!(value("max(1, min(t, body.a_1.vx))"), 3.0);
        assert_eq!(value("body.a_1.vx/Z"), 1.25);
        assert_eq!(value("sqrt(abs(-16)) + exp(0) + ln(1)"), 5.0);
        assert!((value("sin(pi/2) - cos(0)")).abs() < 1e-15);
        assert_eq!(value("sign(-3) + sign(0)"), -1.0);
        // This formula would be wrong if the minus were applied before the power.
        assert_eq!(value("exp(-t^2/2)"), (-4.5f64).exp());
    }

    #[test]
    fn nan_is_not_lost_in_a_minimum() {
        assert!(value("min(0/0, 1)").is_nan());
        assert!(value("max(1, 0/0)").is_nan());
    }

    #[test]
    fn numbers_are_folded() {
        let compiled = Expression::compile("sqrt(2000*1e7)", &|_| None).unwrap();
        assert_eq!(compiled.as_number(), Some(2e10f64.sqrt()));
        let compiled = Expression::compile("2*x", &|_| Some(Meaning::Slot(7))).unwrap();
        assert_eq!(compiled.as_number(), None);
        assert!(compiled.uses(&|slot| slot == 7));
        assert!(!compiled.uses(&|slot| slot < 7));
    }

    /// What is left has one slot for each part, and the same value to the bit.
    #[test]
    fn parts_are_split_off_whole() {
        let meaning = |name: &str| {
            ["x", "y", "t"]
                .iter()
                .position(|n| *n == name)
                .map(Meaning::Slot)
        };
        let formula = "(x + 2*y)*sin(3*t)^2 - 7*(x/t) + 5 + exp(-t)";
        let whole = Expression::compile(formula, &meaning).unwrap();
        let mut rest = whole.clone();
        let of_place = rest.split_off(&|slot| slot < 2, 3);
        let of_time = rest.split_off(&|slot| slot == 2, 5);
        assert_eq!([of_place.len(), of_time.len()], [2, 3]); // x + 2y, x; sin(3t)^2, t, exp(-t)
        let at = [0.3, -1.7, 0.9];
        let mut slots = at.to_vec();
        slots.extend(
            of_place
                .iter()
                .chain(&of_time)
                .map(|part| part.evaluate(&at)),
        );
        assert_eq!(
            rest.evaluate(&slots).to_bits(),
            whole.evaluate(&at).to_bits()
        );
        assert!(!rest.uses(&|slot| slot < 3));
    }

    #[test]
    fn faults_say_where() {
        assert_eq!(fault("1 + ").at, 4..4);
        assert_eq!(fault("1 $ 2").at, 2..3);
        assert_eq!(fault("(1").message, "found the end where `)` should be");
        assert_eq!(fault("2 pi").at, 2..4);
        assert_eq!(fault("min(1)").message, "found `)` where `,` should be");
        assert_eq!(fault("sin 3").at, 4..5);
        assert_eq!(fault("1.2.3").message, "`1.2.3` is not a number");
        let unknown = fault("2*bdy.vx");
        assert_eq!(
            (unknown.at, unknown.unknown_name),
            (2..8, Some("bdy.vx".into()))
        );
        assert_eq!(fault("").at, 0..0);
        assert!(fault(&"(".repeat(1000)).message.contains("nested"));
    }
}
