//! Values as Python writes them, as in the head of an array: `{'descr': '<f8', 'shape': (3, 2), }`.

use std::iter::Peekable;
use std::str::Chars;

/// A literal of Python, as the head of a NumPy array has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum PythonLiteral {
    Text(String),
    Whole(u64),
    Truth(bool),
    /// A tuple or a list.
    List(Vec<PythonLiteral>),
    Dictionary(Vec<(PythonLiteral, PythonLiteral)>),
}

/// Values within values.
const DEPTH: usize = 16;

impl PythonLiteral {
    /// The value that a text writes; `None` where it writes another kind.
    pub(super) fn parse(text: &str) -> Option<Self> {
        value(&mut text.chars().peekable(), DEPTH)
    }

    pub(super) fn get(&self, key: &str) -> Option<&Self> {
        let Self::Dictionary(entries) = self else {
            return None;
        };
        let is = |(own, _): &&(PythonLiteral, PythonLiteral)| matches!(own, Self::Text(own) if own == key);
        entries.iter().find(is).map(|(_, value)| value)
    }

    /// Whole numbers of a list, or a single one.
    pub(super) fn wholes(&self) -> Option<Vec<u64>> {
        let one = |value: &Self| match value {
            Self::Whole(number) => Some(*number),
            _ => None,
        };
        match self {
            Self::List(all) => all.iter().map(one).collect(),
            other => Some(vec![one(other)?]),
        }
    }
}

fn skip(text: &mut Peekable<Chars<'_>>) {
    while text
        .next_if(|c| c.is_whitespace() || matches!(c, ',' | ':'))
        .is_some()
    {}
}

fn value(text: &mut Peekable<Chars<'_>>, depth: usize) -> Option<PythonLiteral> {
    let depth = depth.checked_sub(1)?;
    skip(text);
    match text.next()? {
        quote @ ('\'' | '"') => {
            let mut out = String::new();
            loop {
                match text.next()? {
                    c if c == quote => return Some(PythonLiteral::Text(out)),
                    '\\' => out.push(text.next()?),
                    c => out.push(c),
                }
            }
        }
        '(' => list(text, ')', depth).map(PythonLiteral::List),
        '[' => list(text, ']', depth).map(PythonLiteral::List),
        '{' => {
            let all = list(text, '}', depth)?;
            let pairs = all.chunks_exact(2).map(|p| (p[0].clone(), p[1].clone()));
            Some(PythonLiteral::Dictionary(pairs.collect()))
        }
        first if first.is_ascii_digit() => {
            let mut digits = String::from(first);
            while let Some(digit) = text.next_if(char::is_ascii_digit) {
                digits.push(digit);
            }
            // Python 2 wrote an L behind a long one
            let _ = text.next_if_eq(&'L');
            digits.parse().ok().map(PythonLiteral::Whole)
        }
        first => {
            let mut word = String::from(first);
            while let Some(letter) = text.next_if(|c| c.is_alphabetic()) {
                word.push(letter);
            }
            match &*word {
                "True" => Some(PythonLiteral::Truth(true)),
                "False" => Some(PythonLiteral::Truth(false)),
                _ => None,
            }
        }
    }
}

fn list(text: &mut Peekable<Chars<'_>>, end: char, depth: usize) -> Option<Vec<PythonLiteral>> {
    let mut out = Vec::new();
    loop {
        skip(text);
        if text.next_if_eq(&end).is_some() {
            return Some(out);
        }
        out.push(value(text, depth)?);
    }
}
