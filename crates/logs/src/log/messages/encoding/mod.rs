//! The encodings of messages that are read. A new one is a file of its own and its lines here: its
//! module, and its place in the list.

mod cdr;
mod cursor;
mod descriptor;
mod elements;
mod json;
mod leaves;
mod msg;
mod plan;
mod proto;
mod wire;

pub use cdr::CdrReader;

use std::sync::Arc;

use super::message::{OpenedReader, Schema};
use super::path::FieldPath;

/// Makes a reader of some fields, for each the paths that it may have; `None` for a schema of another encoding.
type ReaderFactory = fn(&Schema, &[Vec<FieldPath>]) -> Option<OpenedReader>;

const ENCODINGS: [ReaderFactory; 3] = [cdr::open, json::open, proto::open];

/// Makes a reader for `fields` of messages: for each the paths that it may have.
pub(super) fn reader_of(schema: &Schema, fields: &[Vec<FieldPath>]) -> OpenedReader {
    let opened = ENCODINGS.iter().find_map(|open| open(schema, fields));
    opened.unwrap_or_else(|| {
        let (encoding, language) = (&schema.encoding, &schema.language);
        Err(format!(
            "its encoding `{encoding}` with a `{language}` definition is not read"
        ))
    })
}

/// Readers of some fields, one for each schema that was met.
#[derive(Default)]
pub(super) struct SchemaReaders(Vec<(Arc<Schema>, OpenedReader)>);

impl SchemaReaders {
    pub(super) fn of(
        &mut self,
        schema: &Arc<Schema>,
        fields: &[Vec<FieldPath>],
    ) -> &mut OpenedReader {
        let known = self.0.iter().position(|(known, _)| known == schema);
        let at = known.unwrap_or_else(|| {
            self.0.push((Arc::clone(schema), reader_of(schema, fields)));
            self.0.len() - 1
        });
        &mut self.0[at].1
    }
}
