//! One TOML text, read with errors that name file, line and the way out.

use cft_ident_core::explain::ErrorText;
use std::collections::BTreeMap;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::ConfigError;
use cft_ident_core::number;
use cft_ident_logs::log::{escape, escape_whole, list, nearest};

/// A TOML text and the name under which errors speak of it.
pub(crate) struct TomlDocument<'a> {
    file: &'a str,
    text: &'a str,
}

impl<'a> TomlDocument<'a> {
    pub(crate) fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text }
    }

    /// Deserialises the text, in which no number may be one that cannot be worked with.
    pub(crate) fn read<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        if self.text.trim_start().starts_with('{') {
            return Err(ConfigError::Kind {
                file: self.file.to_owned(),
                found: "a JSON document",
                wanted: "a file of TOML",
                remedy: "give the file that the command wrote with -o, not the one of --json"
                    .to_owned(),
            });
        }
        let root = DeTable::parse(self.text).map_err(|error| self.explain(&error))?;
        let mut path = Vec::new();
        for (key, value) in root.get_ref() {
            path.push(key.get_ref().to_string());
            self.numbers(value, &mut path)?;
            path.pop();
        }
        T::deserialize(toml::Deserializer::from(root)).map_err(|error| self.explain(&error))
    }

    /// Refuses inf, nan and numbers beyond [`number::LARGEST`] in the value at `path`.
    fn numbers(
        &self,
        value: &toml::Spanned<DeValue<'_>>,
        path: &mut Vec<String>,
    ) -> Result<(), ConfigError> {
        match value.get_ref() {
            DeValue::Float(float) => {
                let number: f64 = float.as_str().parse().unwrap_or(f64::NAN);
                // a variance has the square of its quantity's range
                let size = match path.first().is_some_and(|key| key == "covariance") {
                    true => number.abs().sqrt(),
                    false => number,
                };
                let path: Vec<&str> = path.iter().map(String::as_str).collect();
                // a row that `new` leaves to be filled in is refused by what it lacks
                let open = number.is_nan()
                    && matches!(
                        path[..],
                        ["robot", "link", _, "a" | "alpha" | "d" | "theta"]
                    );
                if number::is_usable(size) || open {
                    return Ok(());
                }
                let written = match number.is_finite() {
                    true => float.as_str().to_owned(),
                    false => number.to_string(),
                };
                return Err(ConfigError::Value {
                    file: self.file.to_owned(),
                    line: self.line(value.span().start),
                    key: dotted(&path),
                    problem: format!("holds {written}{}", number::beyond(number)),
                    remedy: format!("give finite numbers of at most {:e}", number::LARGEST),
                });
            }
            DeValue::Table(table) => {
                for (key, value) in table {
                    path.push(key.get_ref().to_string());
                    self.numbers(value, path)?;
                    path.pop();
                }
            }
            DeValue::Array(array) => {
                for (index, value) in array.iter().enumerate() {
                    // an array of numbers is named as a whole, its line says the rest
                    let inner = matches!(value.get_ref(), DeValue::Table(_));
                    if inner {
                        path.push(index.to_string());
                    }
                    self.numbers(value, path)?;
                    if inner {
                        path.pop();
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Turns an error of the TOML reader into ours.
    fn explain(&self, error: &toml::de::Error) -> ConfigError {
        let line = error.span().map_or(1, |span| self.line(span.start));
        // the TOML reader may append more lines
        let message = error.message().lines().collect::<Vec<_>>().join(" ");
        let listed: Vec<&str> = error.message().split('`').skip(1).step_by(2).collect();
        // serde words an unknown name as: unknown field `x`, expected one of `a`, `b`
        let file = self.file.to_owned();
        let (what, remedy) = match &listed[..] {
            [name, known @ ..] if message.starts_with("unknown field") => {
                let remedy = nearest_or_all(name, known, "known keys here");
                return ConfigError::UnknownKey {
                    file,
                    line,
                    key: escape(name),
                    remedy,
                };
            }
            [name, known @ ..] if message.starts_with("unknown variant") => (
                format!("`{}` is no known value", escape(name)),
                nearest_or_all(name, known, "known values"),
            ),
            [name] if message.starts_with("missing field") => {
                return ConfigError::MissingKey {
                    file,
                    line,
                    key: escape(name),
                    remedy: "it\nthe files in configs/ show how".to_owned(),
                };
            }
            _ if message == "duplicate key" => {
                let name = error.span().and_then(|span| self.text.get(span));
                let name = escape(name.unwrap_or_default().trim());
                let what = format!("duplicate key `{name}`");
                (what, "keep one of the two".to_owned())
            }
            _ => {
                let of_type = message.starts_with("invalid type") || message.starts_with("wanted");
                let remedy = match of_type {
                    true => "give a value of that kind",
                    false => "correct this line: `key = value`, text in quotes",
                };
                (escape_whole(&message), remedy.to_owned())
            }
        };
        ConfigError::Syntax {
            file,
            line,
            problem: ErrorText::new(what).remedy(remedy),
        }
    }

    /// Line of a byte offset, from 1.
    fn line(&self, offset: usize) -> usize {
        let end = offset.min(self.text.len());
        1 + self.text.as_bytes()[..end]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count()
    }

    /// Line of the key at `path`, or of the innermost table on the way; a number stands for an element of an array.
    pub(crate) fn line_of(&self, path: &[&str]) -> usize {
        let mut best = None;
        self.follow(path, |key, _| best = Some(key));
        best.map_or(1, |span: Range<usize>| self.line(span.start))
    }

    /// The number at `path` as it is written; `None` where there is none.
    pub(crate) fn written(&self, path: &[&str]) -> Option<&'a str> {
        let mut found = None;
        let mut steps = 0;
        self.follow(path, |_, value| {
            steps += 1;
            found = Some(value);
        });
        let text = self.text.get(found.filter(|_| steps == path.len())?)?;
        Some(text.trim())
    }

    /// Goes along `path` as far as it exists; `seen` gets the spans of each key (of the value, in an array) and value.
    fn follow(&self, path: &[&str], mut seen: impl FnMut(Range<usize>, Range<usize>)) {
        let Ok(root) = DeTable::parse(self.text) else {
            return;
        };
        let mut table = Some(root.get_ref());
        let mut array: Option<&[toml::Spanned<DeValue<'_>>]> = None;
        for name in path {
            let (key, value) = if let Some(inside) = table {
                let Some((key, value)) = inside.get_key_value(*name) else {
                    return;
                };
                (key.span(), value)
            } else if let Some(inside) = array {
                let found = name
                    .parse::<usize>()
                    .ok()
                    .and_then(|index| inside.get(index));
                let Some(value) = found else { return };
                (value.span(), value)
            } else {
                return;
            };
            seen(key, value.span());
            table = value.get_ref().as_table();
            array = value.get_ref().as_array().map(|elements| &**elements);
        }
    }

    /// The error for a key that must be there; `remedy` reads on after "add".
    pub(crate) fn missing(&self, path: &[&str], remedy: &str) -> ConfigError {
        ConfigError::MissingKey {
            file: self.file.to_owned(),
            line: self.line_of(path),
            key: dotted(path),
            remedy: remedy.to_owned(),
        }
    }

    /// The error for a value that cannot be.
    pub(crate) fn value(&self, path: &[&str], problem: &str, remedy: &str) -> ConfigError {
        ConfigError::Value {
            file: self.file.to_owned(),
            line: self.line_of(path),
            key: dotted(path),
            problem: problem.to_owned(),
            remedy: remedy.to_owned(),
        }
    }

    /// Refuses what is no name for a joint.
    pub(crate) fn plain_name(&self, path: &[&str], joint: &str) -> Result<(), ConfigError> {
        if is_plain_name(joint) {
            return Ok(());
        }
        let remedy = "use letters, digits, `_`, `-` and `.`";
        Err(self.value(path, "is no name for a joint", remedy))
    }

    /// Refuses a table for a joint or coordinate that the robot does not have.
    pub(crate) fn known_names<T>(
        &self,
        table: &[&str],
        entries: &BTreeMap<String, T>,
        known: &[String],
    ) -> Result<(), ConfigError> {
        let Some(name) = entries.keys().find(|name| !known.contains(name)) else {
            return Ok(());
        };
        let path = [table, &[name.as_str()]].concat();
        let all = known.iter().map(String::as_str);
        let remedy = near_and_all(name, all, "this robot has");
        Err(self.value(&path, "is nothing that this robot has", &remedy))
    }

    /// Refuses a joint that the robot does not have.
    pub(crate) fn known_joint(
        &self,
        path: &[&str],
        joint: &str,
        joints: &[String],
    ) -> Result<(), ConfigError> {
        if joints.iter().any(|known| known == joint) {
            return Ok(());
        }
        let remedy = format!("this robot has {}", joints.join(", "));
        Err(self.value(path, "is no joint of this robot", &remedy))
    }

    /// Refuses what is not above 0, where it is given.
    pub(crate) fn positive(
        &self,
        path: &[&str],
        value: impl Into<Option<f64>>,
    ) -> Result<(), ConfigError> {
        let value = match value.into() {
            Some(value) if value.is_nan() || value < number::SMALLEST => value,
            _ => return Ok(()),
        };
        let remedy = match value > 0.0 {
            true => format!("give a number of at least {:e}", number::SMALLEST),
            false => "give a number above 0".to_owned(),
        };
        Err(self.value(path, &format!("is {value:?}"), &remedy))
    }

    /// Refuses what is below 0, where it is given.
    pub(crate) fn not_negative(
        &self,
        path: &[&str],
        value: Option<f64>,
    ) -> Result<(), ConfigError> {
        let possible = |x: f64| x >= 0.0 || x.is_nan();
        self.number(path, value, possible, "give 0 or a number above it")
    }

    /// Refuses a number that is given and not possible.
    pub(crate) fn number(
        &self,
        path: &[&str],
        value: Option<f64>,
        possible: impl Fn(f64) -> bool,
        remedy: &str,
    ) -> Result<(), ConfigError> {
        match value {
            Some(value) if !possible(value) => {
                Err(self.value(path, &format!("is {value}"), remedy))
            }
            _ => Ok(()),
        }
    }
}

/// Whether a text can be the name of a joint.
pub(super) fn is_plain_name(joint: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
    !joint.is_empty() && joint.len() <= 64 && joint.chars().all(plain)
}

/// Whether a section says nothing: it is not written then.
pub(super) fn is_default<T: Default + PartialEq>(section: &T) -> bool {
    *section == T::default()
}

/// The path of a key as it is written in TOML.
fn dotted(path: &[&str]) -> String {
    let shown: Vec<String> = path.iter().map(|part| escape(part)).collect();
    shown.join(".")
}

/// "did you mean `x`? " where a known name is near, and behind `all` the list of known names.
pub(super) fn near_and_all<'k>(
    name: &str,
    known: impl Iterator<Item = &'k str> + Clone,
    all: &str,
) -> String {
    let near = nearest(name, known.clone()).map(|near| format!("did you mean `{near}`? "));
    format!("{}{all} {}", near.unwrap_or_default(), list(known))
}

/// "did you mean `x`?" where a known name is near, else the list of known names.
pub(crate) fn nearest_or_all(name: &str, known: &[&str], what: &str) -> String {
    match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("{what}: {}", known.join(", ")),
    }
}
