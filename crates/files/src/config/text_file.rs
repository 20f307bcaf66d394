//! A file of text, read whole within a bound of its size.

use std::io::Read;
use std::path::Path;

/// Largest file of text that is read whole: a model of 200 links with its covariance has less, and a URDF
/// names its meshes and does not hold them.
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
    String::from_utf8(bytes).map_err(|_| unusable("it is no UTF-8 text"))
}

#[cfg(test)]
mod tests {
    use super::*;

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
