//! JSON as programs write it: with `NaN` and `Infinity`, which JSON does not have.

use std::borrow::Cow;

use serde_json::Value;

/// A JSON text. Numbers that JSON does not have, `NaN` and `Infinity` as Python writes them, are taken for none.
pub(super) fn parsed(text: &[u8]) -> Result<Value, serde_json::Error> {
    serde_json::from_slice(text).or_else(|error| match without_words(text) {
        Cow::Borrowed(_) => Err(error),
        Cow::Owned(plain) => serde_json::from_slice(&plain),
    })
}

/// The text with `null` for `NaN`, `Infinity` and `-Infinity` outside of quotes.
fn without_words(text: &[u8]) -> Cow<'_, [u8]> {
    const WORDS: [&[u8]; 6] = [b"-Infinity", b"Infinity", b"-NaN", b"NaN", b"nan", b"-nan"];
    let mut out: Option<Vec<u8>> = None;
    let (mut at, mut quoted) = (0, false);
    while let Some(byte) = text.get(at) {
        let word = WORDS
            .iter()
            .find(|word| !quoted && text[at..].starts_with(word));
        if let Some(word) = word {
            let kept = out.get_or_insert_with(|| text[..at].to_vec());
            kept.extend(b"null");
            at += word.len();
            continue;
        }
        // what follows a backslash closes no quotes
        let taken = if quoted && *byte == b'\\' { 2 } else { 1 };
        quoted ^= *byte == b'"';
        if let Some(kept) = &mut out {
            kept.extend(text[at..].iter().take(taken));
        }
        at += taken;
    }
    out.map_or(Cow::Borrowed(text), Cow::Owned)
}
