//! The only readers of recordings: from a file to blocks of t, q, tau in SI units.

mod block;
mod error;
mod source;
mod spec;

pub use block::Block;
pub use error::LogError;
pub use source::Provenance;
pub use spec::{LogSpec, Span};

/// Text from a file made safe to print: control characters and backslashes as escapes, cut to 80 characters.
pub fn escape(text: &str) -> String {
    let mut shown = String::new();
    for (index, character) in text.chars().enumerate() {
        if index == 80 {
            shown.push('…');
            break;
        }
        // Direction overrides and other invisible format characters can forge a message as well.
        if character.is_control()
            || matches!(character, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
        {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}
