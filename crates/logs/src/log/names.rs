//! Names that come from files: made safe to print, and compared with the names that are known.

/// Characters of a name that are shown before it is cut.
const MAX_SHOWN_CHARACTERS: usize = 120;

/// A name from a file made safe to print: control and invisible format characters as escapes, cut to 120 characters.
pub fn escape(name: &str) -> String {
    match name.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        None => escape_whole(name),
        Some((end, _)) => escape_whole(&name[..end]) + "…",
    }
}

/// The same for what must not be cut: a path, a message.
pub fn escape_whole(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for character in text.chars() {
        match is_hidden(character) {
            true => shown.extend(character.escape_default()),
            false => shown.push(character),
        }
    }
    shown
}

/// Whether a character is no mark on the screen: control characters, and direction overrides and zero-width
/// characters, which can forge a message as well.
pub fn is_hidden(character: char) -> bool {
    character.is_control()
        || matches!(character,
            '\u{ad}' | '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// The known name nearest to `name`, where one is near enough to be meant.
pub fn nearest<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    let name = name.to_lowercase();
    let mut best: Option<(f64, &str)> = None;
    for candidate in known {
        let similarity = similarity(&name, &candidate.to_lowercase());
        if similarity > best.map_or(0.75, |(score, _)| score) {
            best = Some((similarity, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// "did you mean `x`? " where one of the known names is near, else nothing; `known` is their list as a
/// message has it, parted by commas.
pub fn did_you_mean(name: &str, known: &str) -> String {
    suggestion(name, known.split(", "))
}

/// The same for names from a file.
pub(super) fn suggestion<'k>(name: &str, known: impl IntoIterator<Item = &'k str>) -> String {
    let near = nearest(name, known);
    near.map_or_else(String::new, |near| {
        format!("did you mean `{}`? ", escape(near))
    })
}

/// Nearness of two names in 0..1: by their common beginning, or by a few slips of the finger.
fn similarity(a: &str, b: &str) -> f64 {
    let slips = strsim::osa_distance(a, b);
    let few = slips <= a.chars().count() / 3;
    let by_slips = if few { 0.95 - 0.05 * slips as f64 } else { 0.0 };
    strsim::jaro_winkler(a, b).max(by_slips)
}

/// A list of names for a message, escaped, cut to the first twenty.
pub fn list<'k>(names: impl IntoIterator<Item = &'k str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let shown: Vec<String> = names.iter().take(20).map(|name| escape(name)).collect();
    let shown = shown.join(", ");
    match names.len().saturating_sub(20) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_and_direction_overrides_are_shown_as_escapes() {
        assert_eq!(escape("q\u{1b}[31m1"), "q\\u{1b}[31m1");
        assert_eq!(escape("a\nb\u{202e}c"), "a\\nb\\u{202e}c");
        assert_eq!(escape("Geschwindigkeit φ"), "Geschwindigkeit φ");
        assert_eq!(escape(&"x".repeat(200)).chars().count(), 121);
    }

    #[test]
    fn the_nearest_name_is_offered_only_where_it_is_near() {
        for (name, known, near) in [
            ("cutof_hz", ["cutoff_hz", "order"], Some("cutoff_hz")),
            ("Q_Q1", ["q_q1", "q_q2"], Some("q_q1")),
            ("ctf", ["single-joint", "cft"], Some("cft")),
            ("banana", ["cutoff_hz", "order"], None),
        ] {
            assert_eq!(nearest(name, known), near);
        }
        let said = did_you_mean("paylod", "gain, payload");
        assert_eq!(said, "did you mean `payload`? ");
        assert_eq!(did_you_mean("banana", "gain, payload"), "");
    }
}
