//! A file of text, read whole within a bound of its size.

use std::io::Read;
use std::path::Path;

/// Largest file of text that is read whole: models of 200 links are smaller, and URDFs only name their meshes.
const MOST_BYTES: u64 = 16 << 20;

/// The text of a file that is not too large, whatever stands under its name.
pub(super) fn text_of(path: &Path) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?
        .take(MOST_BYTES + 1)
        .read_to_end(&mut bytes)?;
    let unusable = |what| std::io::Error::new(std::io::ErrorKind::InvalidData, what);
    if bytes.len() as u64 > MOST_BYTES {
        return Err(unusable("it has more than 16 MB"));
    }
    decoded(bytes).map_err(|_| unusable("it is no UTF-8 text"))
}

/// Text in UTF-8, in UTF-16 with its mark, or in the Latin-1 that an XML declares.
fn decoded(bytes: Vec<u8>) -> Result<String, ()> {
    let units = |from: fn([u8; 2]) -> u16| -> Result<String, ()> {
        let pairs = bytes[2..].chunks_exact(2);
        let units: Vec<u16> = pairs.map(|pair| from([pair[0], pair[1]])).collect();
        String::from_utf16(&units).map_err(|_| ())
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => return units(u16::from_le_bytes),
        [0xfe, 0xff, ..] => return units(u16::from_be_bytes),
        _ => {}
    }
    String::from_utf8(bytes).or_else(|error| {
        let bytes = error.into_bytes();
        let end = bytes.iter().take(200).position(|byte| *byte == b'>');
        let declared = String::from_utf8_lossy(&bytes[..end.unwrap_or(0)]).to_lowercase();
        let latin = [
            "iso-8859-1",
            "iso-8859-15",
            "latin1",
            "latin-1",
            "windows-1252",
        ];
        // each byte of Latin-1 is the character of that number
        let known = declared.starts_with("<?xml") && latin.iter().any(|l| declared.contains(l));
        known
            .then(|| bytes.iter().map(|byte| char::from(*byte)).collect())
            .ok_or(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_in_the_encodings_that_it_declares() {
        let utf16: Vec<u8> = [0xff, 0xfe]
            .into_iter()
            .chain("<a\u{e9}/>".encode_utf16().flat_map(u16::to_le_bytes))
            .collect();
        assert_eq!(decoded(utf16).unwrap(), "<a\u{e9}/>");
        let latin = b"<?xml version='1.0' encoding='ISO-8859-1'?><a>\xe9</a>".to_vec();
        assert!(decoded(latin).unwrap().ends_with("<a>\u{e9}</a>"));
        assert!(decoded(b"<a>\xe9</a>".to_vec()).is_err());
    }

    #[test]
    fn a_file_is_read_up_to_the_bound_and_refused_beyond_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, vec![b'#'; MOST_BYTES as usize]).unwrap();
        assert_eq!(text_of(&path).unwrap().len() as u64, MOST_BYTES);
        std::fs::write(&path, vec![b'#'; MOST_BYTES as usize + 1]).unwrap();
        let error = text_of(&path).unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::InvalidData);
        assert_eq!(error.to_string(), "it has more than 16 MB");
    }
}
