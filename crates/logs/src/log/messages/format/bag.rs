//! Messages of one rosbag2 database, in the order in which they were recorded: the only door to SQLite.
//!
//! A database is opened as one that nobody writes, so that no lock and no file beside it is made. Where
//! its recorder was killed, its journal lies beside it: then a copy of both is brought into order.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, params};
use tempfile::TempDir;

use crate::log::content::{CompressionFormat, FileContent};
use crate::log::messages::message::{
    MessageFile, MessageHead, RecordingBreak, Schema, Topic, is_wanted,
};
use crate::log::{LogError, escape_whole, source};

/// Messages that are asked of the database at once, and their bytes at which a page ends earlier.
const PAGE: usize = 256;
const PAGE_BYTES: usize = 4 << 20;
/// The largest message that is read [bytes].
const LARGEST_MESSAGE: i32 = 64 << 20;
/// Why a database with a journal ends early.
const UNCLOSED: &str = "the recorder did not close it: what it had not committed is lost";
const COPY: &str = "copy.db3";
/// Bytes that a database may take once it is decompressed, per byte that it takes compressed.
const LARGEST_RATIO: u64 = 256;

struct BagFile {
    connection: Connection,
    /// Folder of the copy that is read instead of the file, removed when reading ends.
    _copy: Option<TempDir>,
    topics: Vec<Topic>,
    /// Topic by its number in the database.
    numbers: BTreeMap<i64, usize>,
    /// The wanted ones, as SQL lists them.
    filter: String,
    /// Messages that were asked for, the next one last.
    page: Vec<(MessageHead, Vec<u8>)>,
    /// Time and number of the last message of the page.
    last: (i64, i64),
    ended: bool,
    broken: Option<RecordingBreak>,
    messages: u64,
}

pub(super) fn open(
    path: &Path,
    content: FileContent,
    wanted: &[String],
) -> Result<Box<dyn MessageFile>, LogError> {
    let refuse = |reason: String| LogError::Database {
        file: source::shown(path),
        reason: escape_whole(&reason.replace('\n', " ")),
    };
    let journal = match content.compression {
        CompressionFormat::None => journal_of(path),
        _ => None,
    };
    let copy = match (&journal, content.compression) {
        (None, CompressionFormat::None) => None,
        _ => Some(copy_of(path, content, journal.as_ref())?),
    };
    let place = match &copy {
        None => path.to_owned(),
        Some(folder) => folder.path().join(COPY),
    };
    let failed = |error: rusqlite::Error| refuse(error.to_string());
    let thread = OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let (place, how) = match &journal {
        None => (
            unwritten(&place).into(),
            OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI,
        ),
        Some(_) => (place, OpenFlags::SQLITE_OPEN_READ_WRITE),
    };
    let connection = Connection::open_with_flags(place, thread | how).map_err(failed)?;
    connection
        .set_limit(Limit::SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE)
        .map_err(failed)?;
    // A database from elsewhere: its views and functions are not trusted.
    connection
        .execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;")
        .map_err(failed)?;
    let sql = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?1";
    for table in ["topics", "messages"] {
        let exists = connection
            .prepare(sql)
            .and_then(|mut sql| sql.exists([table]));
        if !exists.map_err(failed)? {
            return Err(refuse(format!("it has no table `{table}`")));
        }
    }
    let (topics, numbers) = read_topics(&connection).map_err(failed)?;
    let listed = numbers
        .iter()
        .filter(|(_, topic)| is_wanted(&topics[**topic].name, wanted));
    let filter: Vec<String> = listed.map(|(number, _)| number.to_string()).collect();
    Ok(Box::new(BagFile {
        connection,
        _copy: copy,
        topics,
        numbers,
        filter: filter.join(","),
        page: Vec::new(),
        last: (i64::MIN, i64::MIN),
        ended: false,
        broken: journal.map(|_| RecordingBreak {
            reason: UNCLOSED.to_owned(),
            place: "after its last commit".to_owned(),
        }),
        messages: 0,
    }))
}

impl BagFile {
    fn turn(&mut self) -> Result<(), rusqlite::Error> {
        let sql = format!(
            "SELECT topic_id, timestamp, data, rowid FROM messages \
             WHERE topic_id IN ({}) AND (timestamp, rowid) > (?1, ?2) \
             ORDER BY timestamp, rowid LIMIT {PAGE}",
            self.filter
        );
        let mut statement = self.connection.prepare(&sql)?;
        let mut rows = statement.query(params![self.last.0, self.last.1])?;
        let (mut count, mut bytes) = (0, 0);
        while bytes < PAGE_BYTES {
            let Some(row) = rows.next()? else {
                self.ended = count < PAGE;
                break;
            };
            count += 1;
            let (number, ns): (i64, i64) = (row.get(0)?, row.get(1)?);
            self.last = (ns, row.get(3)?);
            if let Some(topic) = self.numbers.get(&number) {
                let data = row.get_ref(2)?.as_bytes()?.to_vec();
                bytes += data.len();
                let (topic, ns) = (*topic, u64::try_from(ns).unwrap_or_default());
                let head = MessageHead {
                    topic,
                    channel: 0,
                    log_ns: ns,
                    publish_ns: ns,
                    number: 0,
                };
                self.page.push((head, data));
            }
        }
        Ok(())
    }
}

impl MessageFile for BagFile {
    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn broken(&self) -> Option<&RecordingBreak> {
        self.broken.as_ref()
    }

    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, LogError> {
        if self.page.is_empty() && !self.ended {
            // What is read of a page that breaks off is used.
            if let Err(error) = self.turn() {
                self.ended = true;
                self.broken = Some(RecordingBreak {
                    reason: error.to_string(),
                    place: format!("after {} of its messages", self.messages),
                });
            }
            self.page.reverse();
        }
        let Some((head, stored)) = self.page.pop() else {
            return Ok(None);
        };
        self.messages += 1;
        *data = stored;
        let number = self.messages;
        Ok(Some(MessageHead { number, ..head }))
    }
}

/// The topics of a bag, and the index of each by its number in the database.
type BagTopics = (Vec<Topic>, BTreeMap<i64, usize>);

/// Topics with the definitions of their types, which older databases do not hold.
fn read_topics(connection: &Connection) -> Result<BagTopics, rusqlite::Error> {
    let mut definitions: BTreeMap<String, (String, String)> = BTreeMap::new();
    if let Ok(mut statement) = connection
        .prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
    {
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            definitions.insert(row.get(0)?, (row.get(1)?, row.get(2)?));
        }
    }
    let mut topics = Vec::new();
    let mut numbers = BTreeMap::new();
    let mut statement = connection
        .prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let name: String = row.get(2)?;
        let (language, text) = definitions.get(&name).cloned().unwrap_or_default();
        numbers.insert(row.get(0)?, topics.len());
        topics.push(Topic {
            name: row.get(1)?,
            schema: Arc::new(Schema {
                name,
                language,
                text: text.into_bytes(),
                encoding: row.get(3)?,
            }),
        });
    }
    Ok((topics, numbers))
}

/// What a recorder leaves beside a database that it did not close: the end of its name, and its first bytes in use.
const JOURNALS: [(&str, &[u8]); 2] = [
    ("-wal", b"\x37\x7f\x06"),
    ("-journal", b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"),
];

/// A journal in use beside a database, and the end of its name.
type BagJournal = (PathBuf, &'static str);

fn journal_of(database: &Path) -> Option<BagJournal> {
    JOURNALS.into_iter().find_map(|(ending, magic)| {
        let path = beside(database, ending);
        let mut first = Vec::new();
        let file = File::open(&path).ok()?;
        file.take(magic.len() as u64).read_to_end(&mut first).ok()?;
        (first == magic).then_some((path, ending))
    })
}

fn beside(database: &Path, ending: &str) -> PathBuf {
    let mut name = database.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// Copies a database into a folder of its own, decompressed (SQLite reads files only) and with its journal.
fn copy_of(
    path: &Path,
    content: FileContent,
    journal: Option<&BagJournal>,
) -> Result<TempDir, LogError> {
    let failed = |error: io::Error| source::failed(path, error);
    let largest = content.size.saturating_mul(LARGEST_RATIO) + (1 << 20);
    let folder = tempfile::tempdir().map_err(failed)?;
    let place = folder.path().join(COPY);
    let mut file = File::create(&place).map_err(failed)?;
    let mut bytes = content.into_bytes().take(largest + 1);
    let count = io::copy(&mut bytes, &mut file).map_err(failed)?;
    if count > largest {
        return Err(LogError::Database {
            file: source::shown(path),
            reason: format!("it is more than {largest} bytes long once it is decompressed"),
        });
    }
    if let Some((path, ending)) = journal {
        let failed = |error: io::Error| source::failed(path, error);
        let mut from = File::open(path).map_err(failed)?;
        let mut to = File::create(beside(&place, ending)).map_err(failed)?;
        io::copy(&mut from, &mut to).map_err(failed)?;
    }
    Ok(folder)
}

/// The address of a database that nobody writes: SQLite then neither locks it nor makes files beside it.
fn unwritten(path: &Path) -> String {
    let mut address = String::from("file:");
    for byte in path.as_os_str().as_encoded_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'/' => {
                address.push(char::from(*byte));
            }
            b'\\' if cfg!(windows) => address.push('/'),
            _ => address.push_str(&format!("%{byte:02X}")),
        }
    }
    if cfg!(windows) && path.is_absolute() {
        address.insert("file:".len(), '/');
    }
    address + "?immutable=1"
}
