//! Rows as JSON objects, one a line: `{"t": 0.1, "q_q1": 0.2, "tau_q1": 3.0}` by the names of the columns,
//! or `{"t": 0.1, "q": [0.2], "tau": [3.0]}` in joint order.

use std::fmt;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};

use crate::log::columns::choose;
use crate::log::content::{ContentBytes, FileContent};
use crate::log::layout::{Channel, Layout};
use crate::log::rows::LogRows;
use crate::log::stream::HashedReader;
use crate::log::time::RowTime;
use crate::log::{Block, LogError, escape, source};
use cft_ident_core::number::is_usable;

const LONGEST_LINE: usize = 1 << 20;

pub(in crate::log) struct JsonRows {
    path: PathBuf,
    reader: BufReader<ContentBytes>,
    watch: Option<HashedReader>,
    line: Vec<u8>,
    number: u64,
    at: u64,
    slots: KeySlots,
    /// Numbers of the current row: time, positions, torques, velocities; NaN where none stands.
    values: Vec<f64>,
}

/// Which channels the keys of a line fill.
#[derive(Default)]
struct KeySlots {
    keys: Vec<(String, usize)>,
    /// Lists in joint order: key, first place, length.
    lists: [(&'static str, usize, usize); 3],
    /// SI = factor x + offset, of each place.
    scales: Vec<[f64; 2]>,
}

impl KeySlots {
    fn of(layout: &Layout) -> Self {
        let (n, k) = (layout.positions.len(), layout.torques.len());
        let parts = [&layout.positions, &layout.torques, &layout.velocities];
        let channels = std::iter::once(&layout.time).chain(parts.into_iter().flatten());
        let scale = |c: &Channel| [c.factor, c.offset];
        let scales: Vec<[f64; 2]> = channels.clone().map(scale).collect();
        let keys = channels.enumerate();
        KeySlots {
            keys: keys.map(|(place, c)| (c.column.clone(), place)).collect(),
            lists: [
                ("q", 1, n),
                ("tau", 1 + n, k),
                ("dq", 1 + n + k, layout.velocities.len()),
            ],
            scales,
        }
    }
}

impl JsonRows {
    pub(in crate::log) fn open(
        path: &Path,
        content: FileContent,
        layout: &Layout,
    ) -> Result<(Self, Layout), LogError> {
        let watch = content.watch.clone();
        let mut rows = Self {
            path: path.to_owned(),
            reader: BufReader::new(content.into_bytes()),
            watch,
            line: Vec::with_capacity(4096),
            number: 0,
            at: 0,
            slots: KeySlots::default(),
            values: Vec::new(),
        };
        let layout = choose(&keys(rows.peek()?, layout), layout);
        rows.slots = KeySlots::of(&layout);
        rows.values = vec![f64::NAN; rows.slots.scales.len()];
        Ok((rows, layout))
    }

    /// The first line that is not blank; it is read again as the first row.
    fn peek(&mut self) -> Result<&[u8], LogError> {
        let text = self.reader.fill_buf();
        let text = text.map_err(|error| source::failed(&self.path, error))?;
        let mut lines = text.split(|byte| *byte == b'\n');
        let first = lines.find(|line| !line.trim_ascii().is_empty());
        Ok(first.unwrap_or_default())
    }

    fn wrong(&self, problem: String) -> LogError {
        let at = self.place();
        LogError::JsonLine { at, problem }
    }

    fn lacks(&self, key: String) -> LogError {
        let at = self.place();
        LogError::JsonNumber { at, key }
    }

    /// Reads the next line that is not blank; false at the end.
    fn advance(&mut self) -> Result<bool, LogError> {
        loop {
            self.line.clear();
            self.number += 1;
            let most = LONGEST_LINE as u64 + 1;
            let mut limited = Read::by_ref(&mut self.reader).take(most);
            let count = limited.read_until(b'\n', &mut self.line);
            let count = count.map_err(|error| source::failed(&self.path, error))?;
            if count == 0 {
                return Ok(false);
            }
            if count > LONGEST_LINE {
                return Err(LogError::LongLine {
                    at: self.place(),
                    limit: LONGEST_LINE,
                });
            }
            self.at += count as u64;
            if !self.line.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }
}

impl LogRows for JsonRows {
    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        if !self.advance()? {
            return Ok(None);
        }
        self.values.fill(f64::NAN);
        let row = Row {
            slots: &self.slots,
            values: &mut self.values,
        };
        let mut parser = serde_json::Deserializer::from_slice(&self.line);
        let parsed = row.deserialize(&mut parser).and_then(|()| parser.end());
        if let Err(problem) = parsed {
            let cut = self.watch.as_ref().is_some_and(|w| w.is_cut_at(self.at));
            return Err(match cut {
                true => LogError::CutLine { at: self.place() },
                false => self.wrong(problem.to_string()),
            });
        }
        let t = self.values[0];
        match is_usable(t) {
            true => Ok(Some(RowTime::Seconds(t))),
            false => {
                let key = escape(&self.slots.keys[0].0);
                Err(self.lacks(format!("`{key}`, the time")))
            }
        }
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let [(_, _, n), (_, _, k), _] = self.slots.lists;
        if let Some(place) = (1..1 + n + k).find(|i| !is_usable(self.values[*i])) {
            let key = escape(&self.slots.keys[place].0);
            return Err(self.lacks(format!("`{key}`")));
        }
        block.q.extend_from_slice(&self.values[1..1 + n]);
        block.tau.extend_from_slice(&self.values[1 + n..1 + n + k]);
        Ok(())
    }

    fn place(&self) -> String {
        format!("{}:{}", source::shown(&self.path), self.number)
    }

    fn number(&self) -> u64 {
        self.number
    }

    fn is_recording(&self) -> bool {
        false
    }
}

/// Names of the columns that an object holds, lists by those of their joints.
fn keys(line: &[u8], layout: &Layout) -> Vec<String> {
    let object: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(line).unwrap_or_default();
    let mut names = Vec::new();
    for (key, value) in object {
        let channels = match (key.as_str(), value.is_array()) {
            ("q", true) => &layout.positions,
            ("tau", true) => &layout.torques,
            ("dq", true) => &layout.velocities,
            _ => {
                names.push(key);
                continue;
            }
        };
        names.extend(channels.iter().map(|channel| channel.column.clone()));
    }
    names
}

struct Row<'a> {
    slots: &'a KeySlots,
    values: &'a mut [f64],
}

impl<'de> DeserializeSeed<'de> for Row<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object with the time, positions and torques of one row")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(place) = map.next_key_seed(Key(self.slots))? {
            match place {
                KeyPlace::Number(i) => {
                    let [factor, offset] = self.slots.scales[i];
                    self.values[i] = map.next_value::<f64>()? * factor + offset;
                }
                KeyPlace::List(first, length) => map.next_value_seed(ValueList {
                    scales: &self.slots.scales[first..first + length],
                    values: &mut self.values[first..first + length],
                })?,
                KeyPlace::None => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(())
    }
}

/// Where the value of a key goes.
enum KeyPlace {
    Number(usize),
    List(usize, usize),
    None,
}

struct Key<'a>(&'a KeySlots);

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = KeyPlace;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<KeyPlace, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Key<'_> {
    type Value = KeyPlace;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<KeyPlace, E> {
        let named = self.0.keys.iter().find(|(name, _)| name == key);
        let listed = self.0.lists.iter().find(|(name, ..)| *name == key);
        Ok(match (named, listed) {
            (Some((_, place)), _) => KeyPlace::Number(*place),
            (None, Some((_, first, length))) => KeyPlace::List(*first, *length),
            (None, None) => KeyPlace::None,
        })
    }
}

/// A list of numbers, each of which is written to its channel in SI units.
struct ValueList<'a> {
    scales: &'a [[f64; 2]],
    values: &'a mut [f64],
}

impl<'de> DeserializeSeed<'de> for ValueList<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for ValueList<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a list of {} numbers, one a joint", self.values.len())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let mut found = 0;
        while let Some(x) = list.next_element::<f64>()? {
            if let Some(value) = self.values.get_mut(found) {
                let [factor, offset] = self.scales[found];
                *value = x * factor + offset;
            }
            found += 1;
        }
        // velocities may be left out, an empty list stands for none
        match found == 0 || found == self.values.len() {
            true => Ok(()),
            false => Err(A::Error::invalid_length(found, &self)),
        }
    }
}
