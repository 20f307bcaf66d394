//! A robot file with some of its lines changed: the user's own text, comments and all.

use toml::de::{DeTable, DeValue};

/// A key and the value that it is to have.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyEdit {
    /// Tables from the root, then the key.
    pub path: Vec<String>,
    pub value: toml::Value,
}

impl KeyEdit {
    /// `value` for the key at `path`.
    pub fn new(path: &[&str], value: impl Into<toml::Value>) -> Self {
        Self {
            path: path.iter().map(|part| (*part).to_owned()).collect(),
            value: value.into(),
        }
    }

    /// The line as it is written below its table.
    pub fn line(&self) -> String {
        let key = self.path.last().map(|key| quoted(key)).unwrap_or_default();
        format!("{key} = {}", self.value)
    }

    /// The table that it belongs to, as a header.
    pub fn table(&self) -> String {
        let tables = self.path.len().saturating_sub(1);
        let parts = self.path[..tables].iter().map(|part| quoted(part));
        let parts: Vec<String> = parts.collect();
        format!("[{}]", parts.join("."))
    }
}

/// A text with these keys set; `None` where it is no TOML.
pub fn edited(text: &str, edits: &[KeyEdit]) -> Option<String> {
    let mut edits = edits.iter();
    edits.try_fold(text.to_owned(), |text, edit| set(&text, edit))
}

fn set(text: &str, edit: &KeyEdit) -> Option<String> {
    let root = DeTable::parse(text).ok()?;
    let (key, tables) = edit.path.split_last()?;
    let mut table = Some(root.get_ref());
    let mut span = None;
    for name in tables {
        let value = table.and_then(|t| t.get(name.as_str()));
        span = value.map(toml::Spanned::span);
        table = value.and_then(|value| value.get_ref().as_table());
    }
    if let Some(old) = table.and_then(|t| t.get(key.as_str())) {
        let span = old.span();
        let plain = !matches!(old.get_ref(), DeValue::Table(_));
        let (before, behind) = (&text[..span.start], &text[span.end..]);
        return plain.then(|| format!("{before}{}{behind}", edit.value));
    }
    // inside braces
    if let Some(span) = span.filter(|span| text[span.clone()].starts_with('{')) {
        let (head, tail) = text.split_at(span.start + 1);
        let alone = tail.trim_start().starts_with('}');
        let comma = if alone { "" } else { "," };
        return Some(format!("{head} {}{comma}{tail}", edit.line()));
    }
    // below a header of its own
    let header = edit.table();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        at += line.len();
        let bare = line.split('#').next().unwrap_or_default().trim();
        if bare == header {
            let (head, tail) = text.split_at(at);
            let end = if head.ends_with('\n') { "" } else { "\n" };
            return Some(format!("{head}{end}{}\n{tail}", edit.line()));
        }
    }
    let ended = text.is_empty() || text.ends_with('\n');
    let end = if ended { "" } else { "\n" };
    Some(format!("{text}{end}\n{header}\n{}\n", edit.line()))
}

/// A key as TOML has it.
fn quoted(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !key.is_empty() && key.chars().all(bare) {
        true => key.to_owned(),
        false => toml::Value::from(key).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# a robot
[robot]                  # which
model = \"serial\"

[log.joint]
q1 = { position = \"a\" } # first
q2 = { torque_sign = 1.0, position = \"b\" }

[log.joint.q3] # third
position = \"c\"
";

    #[test]
    fn keys_are_set_where_they_are_and_comments_stay() {
        let edits = [
            KeyEdit::new(&["log", "joint", "q1", "torque_sign"], -1.0),
            KeyEdit::new(&["log", "joint", "q2", "torque_sign"], -1.0),
            KeyEdit::new(&["log", "joint", "q3", "torque_sign"], -1.0),
            KeyEdit::new(&["log", "joint", "q.4", "torque_sign"], -1.0),
            KeyEdit::new(&["robot", "gravity"], vec![9.81, 0.0, 0.0]),
        ];
        let text = edited(TEXT, &edits).unwrap();
        assert_eq!(
            text,
            "\
# a robot
[robot]                  # which
gravity = [9.81, 0.0, 0.0]
model = \"serial\"

[log.joint]
q1 = { torque_sign = -1.0, position = \"a\" } # first
q2 = { torque_sign = -1.0, position = \"b\" }

[log.joint.q3] # third
torque_sign = -1.0
position = \"c\"

[log.joint.\"q.4\"]
torque_sign = -1.0
"
        );
        toml::from_str::<toml::Table>(&text).unwrap();
    }

    #[test]
    fn a_text_that_is_no_toml_is_left_alone() {
        assert_eq!(
            edited("[robot", &[KeyEdit::new(&["robot", "x"], 1.0)]),
            None
        );
    }
}
