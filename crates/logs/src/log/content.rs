//! Files opened for what they hold: decompressed on the way, and known by their first bytes.

use std::io::{self, BufReader, Chain, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::stream::HashedReader;
use super::{LogError, source, table};

/// How the JSON documents of this program begin.
pub const DOCUMENT: &[u8] = b"{\n  \"schema\": \"cft-ident/";
/// First bytes of a file of reduced logs.
pub const REDUCED: &[u8] = b"cft-ident reduced\n";

/// Bytes that are looked at.
pub(super) const HEAD: usize = 1 << 16;

/// How the bytes of a file are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CompressionFormat {
    None,
    Gzip,
    Zstd,
    Xz,
    Lz4,
    Bzip2,
}

/// The bytes of a file from its first one on, those that were looked at among them.
pub(super) type ContentBytes = Chain<Cursor<Vec<u8>>, Box<dyn Read + Send>>;

/// A file that is open: how it is compressed, its size, and its bytes.
pub(super) struct FileContent {
    pub(super) compression: CompressionFormat,
    /// Length of the file as it lies on the disk [bytes].
    pub(super) size: u64,
    head: Vec<u8>,
    rest: Box<dyn Read + Send>,
    /// What is known of a stream while it arrives; none of a file.
    pub(super) watch: Option<HashedReader>,
    /// The bytes of the file as they lie on the disk; none of a stream and of several files.
    pub(super) raw: Option<HashedReader>,
    /// Whether the text is that of a table which is none: its lines stand nowhere.
    pub(super) table: bool,
    /// What was left out of a table.
    pub(super) notes: Vec<String>,
}

impl FileContent {
    fn new(head: Vec<u8>, rest: impl Read + Send + 'static) -> Self {
        Self {
            compression: CompressionFormat::None,
            size: 0,
            head,
            rest: Box::new(rest),
            watch: None,
            raw: None,
            table: false,
            notes: Vec::new(),
        }
    }

    pub(super) fn open(path: &Path) -> Result<Self, LogError> {
        Self::open_with(path, &[])
    }

    /// Opens a table that goes on in other files.
    pub(super) fn open_with(path: &Path, more: &[PathBuf]) -> Result<Self, LogError> {
        let fail = |error| source::failed(path, error);
        let file = source::open(path)?;
        let size = file.metadata().map_err(fail)?.len();
        let whole = file.from(0);
        let raw = HashedReader::new(file);
        let mut file = raw.clone();
        let mut magic = Vec::new();
        let read = Read::by_ref(&mut file).take(6).read_to_end(&mut magic);
        read.map_err(fail)?;
        let compression = match magic[..] {
            [0x1f, 0x8b, ..] => CompressionFormat::Gzip,
            _ if magic.starts_with(&ZSTD) => CompressionFormat::Zstd,
            _ if magic == XZ => CompressionFormat::Xz,
            _ if magic.starts_with(&LZ4) => CompressionFormat::Lz4,
            // its level, then the beginning of pi
            [b'B', b'Z', b'h', b'1'..=b'9', b'1', b'A'] => CompressionFormat::Bzip2,
            _ => CompressionFormat::None,
        };
        let mut rest = plain(Cursor::new(magic).chain(file), compression).map_err(fail)?;
        let (mut head, read) = head_of(&mut rest);
        // What comes before the end of a file that is cut off may be used: the error waits there.
        if let Err(error) = read {
            if head.is_empty() {
                return Err(fail(error));
            }
            rest = Box::new(CutOff(error.kind(), error.to_string()));
        }
        if compression == CompressionFormat::None && table::is_table(&head) {
            let mut text = table::open(path, &whole, &head, more)?;
            let read;
            (head, read) = head_of(&mut text);
            read.map_err(fail)?;
            return Ok(Self {
                size,
                notes: std::mem::take(&mut text.notes),
                raw: more.is_empty().then_some(raw),
                table: true,
                ..Self::new(head, text)
            });
        }
        if head.starts_with(REDUCED) {
            return Err(LogError::Format {
                file: source::shown(path),
                kind: "a file of reduced logs",
                remedy: "`lsq`, `validate`, `reduce` and `track` take it\ngive the log itself here",
            });
        }
        Ok(Self {
            compression,
            size,
            raw: Some(raw),
            ..Self::new(head, rest)
        })
    }

    /// Text that arrives while it is read: no more of it is waited for than its first two lines.
    pub(super) fn of_stream(path: &Path, stream: Box<dyn Read + Send>) -> Result<Self, LogError> {
        let mut rest = HashedReader::new(stream);
        let mut head = vec![0; HEAD];
        let mut filled = 0;
        while filled < HEAD && !has_two_lines(&head[..filled]) {
            let count = rest.read(&mut head[filled..]);
            match count.map_err(|error| source::failed(path, error))? {
                0 => break,
                count => filled += count,
            }
        }
        head.truncate(filled);
        Ok(Self {
            watch: Some(rest.clone()),
            ..Self::new(head, rest)
        })
    }

    /// First bytes, decompressed.
    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }

    /// All bytes from the beginning, decompressed.
    pub(super) fn into_bytes(self) -> ContentBytes {
        Cursor::new(self.head).chain(self.rest)
    }
}

/// The first bytes of a text, and whether they could be read.
fn head_of(text: &mut impl Read) -> (Vec<u8>, io::Result<usize>) {
    let mut head = Vec::with_capacity(HEAD);
    let read = text.take(HEAD as u64).read_to_end(&mut head);
    (head, read)
}

/// Whether two whole lines are there that are neither blank nor comments.
fn has_two_lines(text: &[u8]) -> bool {
    let whole = text.split_inclusive(|byte| *byte == b'\n');
    let whole = whole.filter(|line| line.ends_with(b"\n"));
    let described = |line: &&[u8]| !matches!(line.trim_ascii().first(), None | Some(b'#' | b'%'));
    whole.filter(described).count() >= 2
}

/// First bytes of what xz and lz4 compressed.
const XZ: [u8; 6] = *b"\xfd7zXZ\0";
const LZ4: [u8; 4] = [0x04, 0x22, 0x4d, 0x18];
/// First bytes of what zstd compressed.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Bytes that a message may take once it is decompressed, per byte that it takes compressed.
const LARGEST_RATIO: usize = 1024;

/// Decompresses messages that were compressed one by one; its memory is used again.
#[derive(Default)]
pub(super) struct MessageUnpacker {
    inner: Option<zstd::bulk::Decompressor<'static>>,
    plain: Vec<u8>,
}

impl MessageUnpacker {
    /// Decompresses a message in place; one that is not compressed, or damaged, stays as it is.
    pub(super) fn unpack(&mut self, data: &mut Vec<u8>) {
        if !data.starts_with(&ZSTD) {
            return;
        }
        self.inner = self
            .inner
            .take()
            .or_else(|| zstd::bulk::Decompressor::new().ok());
        let Some(inner) = &mut self.inner else {
            return;
        };
        let largest = data.len().saturating_mul(LARGEST_RATIO);
        let stated = zstd::zstd_safe::get_frame_content_size(data).ok().flatten();
        let stated = stated.and_then(|bytes| usize::try_from(bytes).ok());
        self.plain.clear();
        self.plain.reserve(stated.unwrap_or(largest).min(largest));
        if inner.decompress_to_buffer(data, &mut self.plain).is_ok() {
            std::mem::swap(data, &mut self.plain);
        }
    }
}

/// All of what zstd compressed in memory.
///
/// # Errors
/// Bytes that are damaged.
pub fn unpacked(packed: &[u8]) -> io::Result<Vec<u8>> {
    zstd::stream::decode_all(packed)
}

/// A chunk of a ROS 1 bag, at most so many bytes of it.
pub(super) fn unpacked_chunk(packed_by: &str, packed: Vec<u8>, most: u64) -> io::Result<Vec<u8>> {
    let mut plain = Vec::new();
    match packed_by {
        "none" => return Ok(packed),
        "bz2" => {
            let decoder = bzip2::read::BzDecoder::new(packed.as_slice());
            decoder.take(most).read_to_end(&mut plain)?;
        }
        "lz4" => {
            let decoder = lz4::Decoder::new(packed.as_slice())?;
            decoder.take(most).read_to_end(&mut plain)?;
        }
        other => {
            let problem = format!("a chunk is packed by `{other}`, which is not read");
            return Err(io::Error::new(io::ErrorKind::Unsupported, problem));
        }
    }
    Ok(plain)
}

struct CutOff(io::ErrorKind, String);

impl Read for CutOff {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        Err(io::Error::new(self.0, self.1.clone()))
    }
}

fn plain(
    file: Chain<Cursor<Vec<u8>>, HashedReader>,
    compression: CompressionFormat,
) -> io::Result<Box<dyn Read + Send>> {
    Ok(match compression {
        CompressionFormat::None => Box::new(file),
        CompressionFormat::Gzip => {
            Box::new(flate2::bufread::MultiGzDecoder::new(BufReader::new(file)))
        }
        CompressionFormat::Zstd => Box::new(zstd::stream::read::Decoder::new(file)?),
        CompressionFormat::Xz => {
            // the crate unpacks a file as a whole
            let mut plain = tempfile::tempfile()?;
            lzma_rs::xz_decompress(&mut BufReader::new(file), &mut plain)
                .map_err(|error| io::Error::new(io::ErrorKind::UnexpectedEof, error.to_string()))?;
            plain.seek(SeekFrom::Start(0))?;
            Box::new(BufReader::new(plain))
        }
        CompressionFormat::Lz4 => Box::new(lz4::Decoder::new(file)?),
        CompressionFormat::Bzip2 => Box::new(bzip2::read::MultiBzDecoder::new(file)),
    })
}
