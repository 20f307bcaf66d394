//! Where a number stands in a message: `header.stamp.sec`, `position[2]`, `position[name=arm]`, `/joints/0/q`.

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PathStep {
    /// A field of a message; of an array, where it is a number, the element with that index.
    Field(String),
    /// An element of an array, counted from 0.
    Index(usize),
    /// The element at the place of `value` in `list`, beside the array or further out, or whose own field `list` it is.
    Named { list: String, value: String },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FieldPath {
    pub(crate) steps: Vec<PathStep>,
    text: String,
}

impl FieldPath {
    /// Reads a JSON pointer (RFC 6901) or a dotted path; text that is neither is the name of a field.
    pub(crate) fn parse(text: &str) -> Self {
        let steps = match text.strip_prefix('/') {
            Some(pointer) => pointer
                .split('/')
                .map(|part| PathStep::Field(part.replace("~1", "/").replace("~0", "~")))
                .collect(),
            None => dotted(text).unwrap_or_else(|| vec![PathStep::Field(text.to_owned())]),
        };
        let text = text.to_owned();
        Self { steps, text }
    }

    /// Fields of one path each.
    pub(crate) fn each(paths: &[&str]) -> Vec<Vec<Self>> {
        paths.iter().map(|path| vec![Self::parse(path)]).collect()
    }

    /// `FIELD[LIST=NAME]`: an element that is found by its name, whatever characters it has.
    pub(crate) fn named(field: &str, list: &str, name: &str) -> Self {
        Self {
            steps: vec![
                PathStep::Field(field.to_owned()),
                PathStep::Named {
                    list: list.to_owned(),
                    value: name.to_owned(),
                },
            ],
            text: format!("{field}[{list}={name}]"),
        }
    }

    /// A path of these steps.
    pub(crate) fn of_steps(steps: Vec<PathStep>) -> Self {
        let text = String::new();
        Self { steps, text }
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }
}

/// Steps of a dotted path; `None` where the text has another form.
fn dotted(text: &str) -> Option<Vec<PathStep>> {
    let mut steps = Vec::new();
    let mut rest = text;
    loop {
        let end = rest.find(['.', '[']).unwrap_or(rest.len());
        let (name, tail) = rest.split_at(end);
        let plain = |c: char| c.is_alphanumeric() || c == '_';
        if name.is_empty() || !name.chars().all(plain) {
            return None;
        }
        steps.push(PathStep::Field(name.to_owned()));
        rest = tail;
        while let Some(inner) = rest.strip_prefix('[') {
            let (selector, tail) = inner.split_once(']')?;
            steps.push(match selector.split_once('=') {
                Some((list, value)) => PathStep::Named {
                    list: list.trim().to_owned(),
                    value: value.trim().to_owned(),
                },
                None => PathStep::Index(selector.trim().parse().ok()?),
            });
            rest = tail;
        }
        match rest.strip_prefix('.') {
            Some(tail) => rest = tail,
            None if rest.is_empty() => return Some(steps),
            None => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(name: &str) -> PathStep {
        PathStep::Field(name.to_owned())
    }

    #[test]
    fn dotted_paths_indices_names_and_pointers_are_read() {
        let steps = |text: &str| FieldPath::parse(text).steps;
        let named = FieldPath::named("position", "name", "left/arm 1").steps;
        for (text, expected) in [
            (
                "header.stamp.sec",
                ["header", "stamp", "sec"].map(field).to_vec(),
            ),
            ("a[2].b", vec![field("a"), PathStep::Index(2), field("b")]),
            ("position[name=left/arm 1]", named),
            (
                "/joints/0/a~1b~0",
                ["joints", "0", "a/b~"].map(field).to_vec(),
            ),
        ] {
            assert_eq!(steps(text), expected, "{text}");
        }
    }

    #[test]
    fn any_other_text_is_the_name_of_one_field() {
        for text in ["motor torque", "q1 [deg]", "a..b", "a[x]", "a[1", "", "#3"] {
            assert_eq!(FieldPath::parse(text).steps, [field(text)], "{text}");
        }
    }
}
