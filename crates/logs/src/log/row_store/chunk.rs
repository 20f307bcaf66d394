//! Rows that are kept together, in memory or as bytes of the temporary file.

use super::super::time::{Instant, RowTime};

/// Rows of a chunk, fewer where they are wide.
pub(super) const ROWS: usize = 1024;
/// Numbers of a chunk, but for its last row.
pub(super) const NUMBERS: usize = 1 << 15;

/// So many rows, one behind the other.
#[derive(Default)]
pub(super) struct RowChunk {
    pub stamps: Vec<RowTime>,
    /// Line or message number of each row.
    pub numbers: Vec<u64>,
    /// Whether a row equals the one before it, and whether one of its channels cannot be used.
    pub flags: Vec<(bool, bool)>,
    /// Positions, torques and velocities of each row [SI].
    pub values: Vec<f64>,
}

/// Bytes of a row beside its values: kind and number of its stamp, its own number, its flags.
pub(super) const ROW_BYTES: usize = 1 + 16 + 8 + 1;

impl RowChunk {
    pub fn bytes(&self) -> usize {
        let row = size_of::<RowTime>() + size_of::<u64>() + size_of::<(bool, bool)>();
        self.stamps.len() * row + 8 * self.values.len()
    }

    pub fn written(&self) -> Vec<u8> {
        let rows = self.stamps.len();
        let width = self.values.len() / rows.max(1);
        let mut out = Vec::with_capacity(rows * (ROW_BYTES + 8 * width));
        for row in 0..rows {
            let (kind, stamp) = match self.stamps[row] {
                RowTime::Seconds(t) => (0, i128::from(t.to_bits())),
                RowTime::Exact(instant) => (1, instant.0),
            };
            out.push(kind);
            out.extend(stamp.to_le_bytes());
            out.extend(self.numbers[row].to_le_bytes());
            let (repeats, bad) = self.flags[row];
            out.push(u8::from(repeats) | u8::from(bad) << 1);
            for value in &self.values[row * width..(row + 1) * width] {
                out.extend(value.to_le_bytes());
            }
        }
        out
    }

    pub fn of(bytes: &[u8], width: usize) -> Self {
        let mut chunk = Self::default();
        let number = |bytes: &[u8]| u64::from_le_bytes(std::array::from_fn(|k| bytes[k]));
        for row in bytes.chunks_exact(ROW_BYTES + 8 * width) {
            let stamp = i128::from_le_bytes(std::array::from_fn(|k| row[1 + k]));
            chunk.stamps.push(match row[0] {
                0 => RowTime::Seconds(f64::from_bits(stamp as u64)),
                _ => RowTime::Exact(Instant(stamp)),
            });
            chunk.numbers.push(number(&row[17..]));
            chunk.flags.push((row[25] & 1 != 0, row[25] & 2 != 0));
            let values = row[ROW_BYTES..].chunks_exact(8);
            (chunk.values).extend(values.map(|value| f64::from_bits(number(value))));
        }
        chunk
    }
}
