//! Formulas that come as text: functions of named numbers, evaluated, or written as an expression of C and Rust.

use std::str::FromStr;

use exmex::{
    BinOp, Express, FlatEx, FloatOpsFactory, MakeOperators, MatchLiteral, NumberMatcher, Operator,
};

/// A formula in named numbers.
#[derive(Debug, Clone)]
pub struct Formula {
    text: String,
    compiled: FlatEx<f64, FloatOpsFactory<f64>, WrittenNumber>,
}

/// Most names in one formula.
pub const MOST_NAMES: usize = 16;

impl Formula {
    /// Reads a formula.
    ///
    /// # Errors
    /// Why it is none.
    pub fn parse(text: &str) -> Result<Self, String> {
        let compiled = FlatEx::<f64, FloatOpsFactory<f64>, WrittenNumber>::parse(text)
            .map_err(|error| error.to_string())?;
        let names = compiled.var_names().len();
        if names > MOST_NAMES {
            return Err(format!("more than {MOST_NAMES} names in it"));
        }
        // what cannot be reckoned at all is reported here
        let tried = compiled.eval(&[0.5; MOST_NAMES][..names]);
        tried.map_err(|error| error.to_string())?;
        Ok(Self {
            text: text.to_owned(),
            compiled,
        })
    }

    /// The names in it, at most [`MOST_NAMES`].
    pub fn names(&self) -> &[String] {
        self.compiled.var_names()
    }

    /// Its value for one number per name; no number where it has none, as the root of what is negative.
    pub fn value(&self, of: &[f64]) -> f64 {
        self.compiled.eval(of).unwrap_or(f64::NAN)
    }

    /// The same as an operand of an expression that C and Rust share; functions are those of `math.h`. For each name
    /// stands a name, a number, a call, or what has brackets around it.
    ///
    /// # Errors
    /// What the parser says, which has read the formula before.
    pub fn code(&self, of: &[String]) -> Result<String, String> {
        let names: Vec<FormulaCode> = of.iter().map(|text| FormulaCode::operand(text)).collect();
        let read = FlatEx::<FormulaCode, CodeOperators, WrittenNumber>::parse(&self.text);
        let written = read.and_then(|formula| formula.eval(&names));
        written
            .map(|code| code.in_brackets())
            .map_err(|error| error.to_string())
    }
}

/// Numbers as they are written, powers of ten included: 2, .5, 1e-3.
#[derive(Debug, Clone)]
struct WrittenNumber;

impl MatchLiteral for WrittenNumber {
    fn is_literal(text: &str) -> Option<&str> {
        let digits = NumberMatcher::is_literal(text)?;
        let rest = text.get(digits.len()..)?;
        let power = rest.strip_prefix(['e', 'E']).unwrap_or_default();
        let unsigned = power.strip_prefix(['+', '-']).unwrap_or(power);
        let places = unsigned.bytes().take_while(u8::is_ascii_digit).count();
        match places {
            0 => Some(digits),
            _ => text.get(..text.len() - unsigned.len() + places),
        }
    }
}

/// A number as text of a program: the formula is evaluated in it by the same parser.
#[derive(Debug, Clone, Default)]
struct FormulaCode {
    text: String,
    /// Needs brackets as an operand.
    compound: bool,
}

impl FromStr for FormulaCode {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self::number)
    }
}

impl FormulaCode {
    fn number(x: f64) -> Self {
        Self::operand(&format!("{x:?}"))
    }

    fn operand(text: &str) -> Self {
        Self {
            text: text.to_owned(),
            compound: text.starts_with('-'),
        }
    }

    fn compound(text: String) -> Self {
        Self {
            text,
            compound: true,
        }
    }

    fn in_brackets(&self) -> String {
        match self.compound {
            true => format!("({})", self.text),
            false => self.text.clone(),
        }
    }

    fn call(function: &str, of: &[&Self]) -> Self {
        let of: Vec<&str> = of.iter().map(|code| code.text.as_str()).collect();
        Self::operand(&format!("{function}({})", of.join(", ")))
    }
}

/// The operators of the numbers, with the same order among them.
#[derive(Debug, Clone)]
struct CodeOperators;

/// An operator between two.
macro_rules! between {
    ($prio:literal, $commutes:literal, $text:literal) => {
        BinOp {
            apply: |x, y| {
                let (x, y) = (x.in_brackets(), y.in_brackets());
                FormulaCode::compound(format!(concat!("{} ", $text, " {}"), x, y))
            },
            prio: $prio,
            is_commutative: $commutes,
        }
    };
}

/// A function of two.
macro_rules! of_two {
    ($name:literal, $prio:literal, $function:literal) => {
        Operator::make_bin(
            $name,
            BinOp {
                apply: |x, y| FormulaCode::call($function, &[&x, &y]),
                prio: $prio,
                is_commutative: false,
            },
        )
    };
}

/// Functions of one.
macro_rules! of_one {
    ($($name:literal $function:literal),* $(,)?) => {
        [$(Operator::make_unary($name, |x| FormulaCode::call($function, &[&x]))),*]
    };
}

impl MakeOperators<FormulaCode> for CodeOperators {
    fn make<'a>() -> Vec<Operator<'a, FormulaCode>> {
        use std::f64::consts::{E, PI, TAU};
        let constant = |name, x| Operator::make_constant(name, FormulaCode::number(x));
        let mut all = vec![
            of_two!("^", 4, "pow"),
            Operator::make_bin("*", between!(2, true, "*")),
            Operator::make_bin("/", between!(3, false, "/")),
            Operator::make_bin_unary("+", between!(0, true, "+"), |x| x),
            Operator::make_bin_unary("-", between!(1, false, "-"), |x| {
                FormulaCode::compound(format!("-{}", x.in_brackets()))
            }),
            of_two!("atan2", 0, "atan2"),
            of_two!("min", 0, "fmin"),
            of_two!("max", 0, "fmax"),
            Operator::make_unary("signum", |x| {
                FormulaCode::call("copysign", &[&FormulaCode::number(1.0), &x])
            }),
            Operator::make_unary("fract", |x| {
                FormulaCode::call("fmod", &[&x, &FormulaCode::number(1.0)])
            }),
            constant("PI", PI),
            constant("π", PI),
            constant("E", E),
            constant("e", E),
            constant("TAU", TAU),
            constant("τ", TAU),
        ];
        all.extend(of_one![
            "abs" "fabs", "sin" "sin", "cos" "cos", "tan" "tan", "asin" "asin", "acos" "acos",
            "atan" "atan", "sinh" "sinh", "cosh" "cosh", "tanh" "tanh", "asinh" "asinh",
            "acosh" "acosh", "atanh" "atanh", "floor" "floor", "round" "round", "ceil" "ceil",
            "trunc" "trunc", "exp" "exp", "sqrt" "sqrt", "cbrt" "cbrt", "ln" "log",
            "log2" "log2", "log10" "log10", "log" "log",
        ]);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operator_of_a_formula_has_its_code() {
        let numbers = FloatOpsFactory::<f64>::make();
        let code = CodeOperators::make();
        assert_eq!(numbers.len(), code.len());
        for of in &numbers {
            let same = code.iter().find(|c| c.repr() == of.repr());
            let same = same.unwrap_or_else(|| panic!("{}", of.repr()));
            assert_eq!(of.has_bin(), same.has_bin(), "{}", of.repr());
            assert_eq!(of.has_unary(), same.has_unary(), "{}", of.repr());
            if let (Ok(own), Ok(same)) = (of.bin(), same.bin()) {
                assert_eq!(
                    (own.prio, own.is_commutative),
                    (same.prio, same.is_commutative)
                );
            }
            let value = same.constant().map(|code| code.text.parse().unwrap());
            assert_eq!(of.constant(), value, "{}", of.repr());
        }
    }

    #[test]
    fn code_has_the_order_of_the_formula() {
        let code = |text: &str| {
            let formula = Formula::parse(text).unwrap();
            let names: Vec<String> = formula.names().iter().map(|n| format!("<{n}>")).collect();
            formula.code(&names).unwrap()
        };
        assert_eq!(code("-a^2"), "pow(-<a>, 2.0)");
        assert_eq!(code("a - b - c"), "((<a> - <b>) - <c>)");
        assert_eq!(code("max(a, 2*b)"), "fmax(<a>, 2.0 * <b>)");
        assert_eq!(code("{q_arm 2}/3"), "(<q_arm 2> / 3.0)");
        assert_eq!(
            code("2e-3*e - .5E2"),
            "((0.002 * 2.718281828459045) - 50.0)"
        );
        assert_eq!(code("2*e-3"), "((2.0 * 2.718281828459045) - 3.0)");
    }

    #[test]
    fn what_is_no_formula_is_reported() {
        for text in ["", "cos(", "2 q", "cos", "((a)"] {
            assert!(Formula::parse(text).is_err(), "{text}");
        }
        let many: Vec<String> = (0..17).map(|i| format!("x{i}")).collect();
        assert!(Formula::parse(&many.join("+")).is_err());
    }
}
